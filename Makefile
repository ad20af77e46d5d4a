# Every target does its own set-up inside this folder. Wanted on the machine: Python >= 3.11, Rust, a C compiler.
# PYTHON=... chooses the interpreter, PYTEST="..." adds options to pytest, STICKSLIP_DATA=... says where real records lie.

.PHONY: help setup demo docs wheel test test-long test-slow test-core test-python check static format-check lint types format bench films explorer explorer-test lock clean
.DEFAULT_GOAL := help

UV := .tools/uv
UV_VERSION := 0.13.8
BIN := .venv/bin
PYTHON ?= $(shell for python in python3 python3.13 python3.12 python3.11 python; do \
	"$$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && { command -v "$$python"; break; }; done)
PYTEST ?=
PACKAGE := $(shell find python -name '*.py' -o -name '*.pyi')
TESTS := $(shell find tests crates/stickslip/tests examples docs -type f) README.md pyproject.toml
RUST := Cargo.toml Cargo.lock $(shell find crates -name '*.rs' -o -name Cargo.toml)

export MPLBACKEND := Agg
# Tests start many processes: compiled modules are kept.
unexport PYTHONDONTWRITEBYTECODE
# pyo3 asks the first python on the PATH otherwise, which may be too old.
export PYO3_PYTHON := $(CURDIR)/$(BIN)/python
# A new rustup is on the PATH only after the next login.
export PATH := $(PATH):$(HOME)/.cargo/bin

help:
	@echo "make demo     the whole way on what ships with the package, report in demo-report/"
	@echo "make docs     the documentation site, in build/docs/"
	@echo "make wheel    a wheel and a source archive in dist/, tried in a clean environment"
	@echo "make test     tests of the core and of the Python package (test-long: what takes a second or more; test-slow: what takes minutes)"
	@echo "make check    the gate: format, lint, types (these three: make static), tests"
	@echo "make format   rewrite Rust and Python in the common format"
	@echo "make bench    benchmarks, side by side with other solvers"
	@echo "make films    tracking of films whose truth is known, side by side with other trackers (an hour)"
	@echo "make explorer the explorer's script and core, from web/ and crates/stickslip-wasm (needs Node and the target wasm32)"
	@echo "make explorer-test  the page in a headless browser"
	@echo "make setup    the environment in .venv only"
	@echo "make lock     resolve the Python dependencies anew into requirements.lock"
	@echo "make clean    remove everything the targets made"

# A second run redoes nothing where nothing changed, as with `go test`; the gate always runs its tests.
demo: demo-report/report.html
	@echo $<

demo-report/report.html: .venv/.built $(PACKAGE)
	$(BIN)/stickslip demo -o demo-report

docs: .venv/.built
	$(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going --jobs auto -b html docs build/docs
	@echo build/docs/index.html

# Dependencies come as the lock has them; the wheel itself is what was just built.
wheel: .venv/.installed .tools/.rust
	rm -rf dist build/wheel
	$(BIN)/maturin build --quiet --release --sdist --locked --out dist
	$(UV) venv --quiet --no-python-downloads --python $(BIN)/python build/wheel
	sed 's/ *\\$$//; /^ *--hash/d' requirements.lock > build/wheel/lock.txt
	$(UV) pip install --quiet --python build/wheel/bin/python --constraint build/wheel/lock.txt dist/*.whl
	cd build/wheel && bin/stickslip example && bin/stickslip simulate example/system.toml -o orbit.nc
	@ls dist

test: .venv/.tested
	@echo "every test passed on these files (make check runs them again)"

.venv/.tested: .venv/.built $(PACKAGE) $(TESTS)
	@rm -f $@
	@$(MAKE) --no-print-directory --jobs 2 test-core test-python # the core's compiler fills the pauses of the others
	@touch $@

test-core: .tools/.rust
	@# make shares no places with cargo, which would warn of it
	MAKEFLAGS= cargo test --quiet --package stickslip
	MAKEFLAGS= cargo test --quiet --release --package stickslip-judge

test-python: .venv/.built
	@# a process for each core: threads of the linear algebra would only wait for each other
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest --quiet --numprocesses auto --dist loadfile $(MARKS) $(PYTEST)

# What `make test` leaves out to end within three minutes, but the gate does not.
test-long: MARKS := -m "long and not slow"
test-long: test-python

test-slow: .venv/.built
	$(BIN)/python docs/evidence/slow_tests.py --keep build/slow-tests.jsonl
	$(BIN)/python docs/evidence/events.py

check: static
	@$(MAKE) --no-print-directory --jobs 2 test-core test-python MARKS='-m "not slow"'

static: format-check lint types

format-check: .venv/.installed .tools/.rust
	cargo fmt --all --check
	$(BIN)/ruff format --quiet --check .

lint: .venv/.installed .tools/.rust
	cargo clippy --quiet --locked --workspace --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --quiet --locked --no-deps --package stickslip --package stickslip-lanes
	$(BIN)/ruff check --quiet .

types: .venv/.built
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest stickslip._core

format: .venv/.installed .tools/.rust
	cargo fmt --all
	$(BIN)/ruff check --quiet --fix-only .
	$(BIN)/ruff format --quiet .

# What is done is kept in build/films, so a run that was interrupted goes on.
films: .venv/.built .tools/trackers/.installed
	PYTHONPATH=python .tools/trackers/bin/python docs/evidence/films.py build/films

bench: .venv/.built .venv/.peers
	$(BIN)/python benchmarks/run.py -o docs/evidence/speed.md
	$(BIN)/python benchmarks/explorer.py

# What is built here is committed: nothing else needs Node or the target. No file names this machine.
WASM := wasm32-unknown-unknown
# What the compiler uses of WebAssembly beyond its first version: the optimizer must know. Nothing lies in the first kilobyte: the
# stack comes first, and grows down to it.
WASM_HAS := $(addprefix --enable-,bulk-memory sign-ext nontrapping-float-to-int mutable-globals simd)
explorer: .tools/.rust web/node_modules
	rustup target add $(WASM)
	RUSTC_BOOTSTRAP=1 CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS='-Zlocation-detail=none -Ctarget-feature=+simd128' \
		cargo build --quiet --locked --profile wasm --package stickslip-wasm --target $(WASM)
	web/node_modules/.bin/wasm-opt -Os --converge --low-memory-unused $(WASM_HAS) target/$(WASM)/wasm/stickslip_wasm.wasm -o target/$(WASM)/wasm/core.wasm
	$(PYTHON) python/stickslip/explorer/packing.py target/$(WASM)/wasm/core.wasm python/stickslip/explorer/core.wasm.lzma
	cd web && npm run --silent build

web/node_modules: web/package-lock.json
	cd web && npm ci --silent --ignore-scripts
	@touch $@

explorer-test: .venv/.built
	STICKSLIP_BROWSER=required $(BIN)/python -m pytest --quiet tests/test_explorer_browser.py tests/test_explorer_files.py -m "slow or not slow" $(PYTEST)

setup: .venv/.built

# Universal: one file for Python 3.11 and later on every platform. Keeps the versions it can; UPGRADE=--upgrade takes new ones.
lock: $(UV)
	$(UV) pip compile --quiet --universal --python-version 3.11 --group dev --group docs --generate-hashes --no-emit-index-url \
		--no-emit-find-links --custom-compile-command "make lock" $(UPGRADE) pyproject.toml --output-file requirements.lock
	$(UV) pip compile --quiet --universal --python-version 3.11 --group bench --constraint requirements.lock --generate-hashes \
		--no-emit-index-url --no-emit-find-links --custom-compile-command "make lock" $(UPGRADE) pyproject.toml \
		--output-file benchmarks/requirements.lock
	$(UV) pip compile --quiet --universal --python-version 3.11 --group films --constraint requirements.lock --generate-hashes \
		--no-emit-index-url --no-emit-find-links --custom-compile-command "make lock" $(UPGRADE) pyproject.toml \
		--output-file docs/evidence/films.lock

clean:
	rm -rf .venv .tools target build web/node_modules demo-report .hypothesis .mypy_cache .pytest_cache .ruff_cache
	rm -f python/stickslip/_core.*.so
	find python tests benchmarks examples -name __pycache__ -prune -exec rm -rf {} + 2>/dev/null || true

# --- set-up, one stamp a step -------------------------------------------------------------------------------------

# The uv on the PATH where it is new enough for pyproject.toml, else one of our own.
$(UV):
	@mkdir -p .tools
	@if uv cache dir >/dev/null 2>&1; then ln -sf "$$(command -v uv)" $(UV); \
	else \
		test -n "$(PYTHON)" || { echo "stickslip needs Python 3.11 or newer: install it, or name it with make PYTHON=..." >&2; exit 1; }; \
		echo "stickslip: fetching uv $(UV_VERSION) into .tools"; \
		"$(PYTHON)" -m venv --clear .tools/venv \
			|| { echo "stickslip needs Python's venv module: install it (Debian, Ubuntu: apt install python3-venv), then run make again." >&2; exit 1; }; \
		.tools/venv/bin/python -m pip install --quiet --disable-pip-version-check uv==$(UV_VERSION) && ln -sf venv/bin/uv $(UV); \
	fi

.tools/.rust:
	@command -v cargo >/dev/null || { echo "stickslip needs Rust: install it from https://rustup.rs, then run make again." >&2; exit 1; }
	@command -v cc >/dev/null || { echo "stickslip needs a C compiler to link with: install gcc or clang, then run make again." >&2; exit 1; }
	@mkdir -p .tools && touch $@

.venv/.installed: requirements.lock | $(UV)
	@test -n "$(PYTHON)" || { echo "stickslip needs Python 3.11 or newer: install it, or name it with make PYTHON=..." >&2; exit 1; }
	@$(BIN)/python -c '' 2>/dev/null || $(UV) venv --quiet --clear --no-python-downloads --python "$(PYTHON)" .venv
	$(UV) pip sync --quiet --python $(BIN)/python --require-hashes --compile-bytecode requirements.lock
	@touch $@

# The other solvers of `make bench`, into the same environment: nothing else needs them.
.venv/.peers: benchmarks/requirements.lock .venv/.installed
	$(UV) pip install --quiet --python $(BIN)/python --require-hashes --requirement benchmarks/requirements.lock
	@touch $@

# The other trackers of `make films`, in an environment of their own: they bring another OpenCV.
.tools/trackers/.installed: docs/evidence/films.lock .venv/.installed
	$(UV) venv --quiet --clear --no-python-downloads --python $(BIN)/python .tools/trackers
	$(UV) pip sync --quiet --python .tools/trackers/bin/python --require-hashes docs/evidence/films.lock
	@touch $@

# Built by the maturin of requirements.lock, so that it too is checked by its hash and a rebuild needs no network.
# The stamp has the time of the start: what is edited during a build is built next time.
# Always refreshed: make knows what changed, and uv's cache of the built package outlives `make clean`.
.venv/.built: $(RUST) pyproject.toml .venv/.installed | .tools/.rust
	@echo "stickslip: building the core"
	@touch $@.begun
	$(UV) pip install --quiet --python $(BIN)/python --no-deps --no-build-isolation \
		--reinstall-package stickslip --refresh-package stickslip --editable .
	@mv $@.begun $@
