"""The explorer without a browser: the shipped module gives the package's bits, the page holds what it should and no more."""

import hashlib
import itertools
import json
import lzma
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import wasmtime

import stickslip as ss
from stickslip import _core
from stickslip.explorer import content_of, content_of_system, page
from stickslip.explorer.catalogue import full, laws, oscillator
from stickslip.explorer.page import described_presets, presets
from stickslip.laws import Law
from stickslip.laws.state_law import StateLaw

ROOT = Path(__file__).parents[1]
SHIPPED = ROOT / "python" / "stickslip" / "explorer"
ORBIT, STATES, STEADY, CURVE, SURFACE, LYAPUNOV = range(6)
STALE = "the shipped core gives other numbers than this one: run make explorer"


class Module:
    """The shipped module outside a browser: it imports nothing."""

    def __init__(self):
        engine = wasmtime.Engine()
        module = wasmtime.Module(engine, lzma.decompress((SHIPPED / "core.wasm.lzma").read_bytes()))
        self.store = wasmtime.Store(engine)
        exports = wasmtime.Instance(self.store, module, []).exports(self.store)
        self.memory = exports["memory"]
        self.functions = exports

    def call(self, name, *arguments):
        return self.functions[name](self.store, *arguments)

    def ask(self, verb, question, columns=()):
        text = json.dumps(question).encode()
        at = self.call("question", len(text))
        self.memory.write(self.store, text, at)
        numbers = np.concatenate([np.zeros(0), *columns]).astype("<f8")
        self.memory.write(self.store, numbers.tobytes(), self.call("columns", len(numbers)))
        bad = self.call("answer", verb)
        words = self.read("words", 1).decode()
        if bad:
            raise ValueError(words)
        return json.loads(words), np.frombuffer(bytes(self.read("numbers", 8)), "<f8")

    def read(self, name, width):
        at, count = self.call(name), self.call(f"{name}_len")
        return self.memory.read(self.store, at, at + width * count)

    def events(self, system, t_end, x0):
        """t, kind, contact, x, v, force, stick_time, force_rate of every event."""
        question = {"t_end": t_end, "x0": [x0], "v0": None, "max_events": 10**7, "per_segment": 1, "samples": 0}
        words, numbers = self.ask(ORBIT, {"system": json.loads(system.to_json()), **question})
        columns = 1 + 2 * words["masses"] + 3 * words["contacts"]
        return numbers[words["samples"] * columns :].reshape(-1, 8)


@pytest.fixture(scope="module")
def module():
    return Module()


def same_bits(one, other):
    one, other = np.ascontiguousarray(one), np.ascontiguousarray(other)
    # The signs and payloads of what is no number are nobody's business.
    return np.array_equal(np.isnan(one), np.isnan(other)) and np.array_equal(
        np.nan_to_num(one).view(np.int64), np.nan_to_num(other).view(np.int64)
    )


def rows(orbit):
    kinds = orbit.events["kind"].cat.codes.to_numpy(float)
    columns = [
        orbit.events[name].to_numpy(float) for name in ("t", "contact", "x", "v", "force", "stick_time", "force_rate")
    ]
    return np.column_stack([columns[0], kinds, *columns[1:]])


MOVING = [name for name, law in Law.ALL.items() if not issubclass(law, StateLaw)]


@pytest.mark.parametrize("name", MOVING)
def test_events_are_those_of_the_package_to_the_bit(module, name):
    """Eighteen orbits of each of fourteen laws, 252 in all: slow and fast drives, free and forced, damped or not."""
    law = Law.ALL[name].example()
    count = 0
    forcings = [(), ss.Harmonic(0.3, 0.7), ss.Harmonic(0.03, 1.25)]
    for damping, speed, forcing in itertools.product([0.0, 0.15], [0.1, 0.35, 0.9], forcings):
        system = ss.Oscillator(damping, speed, law, forcing=forcing)
        here = rows(ss.simulate(system, 60.0, x0=0.3))
        assert same_bits(module.events(system, 60.0, 0.3), here), STALE
        count += len(here)
    assert count > 50


@pytest.mark.parametrize(
    ("law", "damping", "t_end", "max_events"),
    [
        (ss.laws.PiecewiseLinear([(0, 1), (1, -1)], break_away=1.2), 0.05, 3000.0, 10**6),
        (ss.laws.StaticKinetic(1.0, 0.5), 0.05, 500.0, 1),
        (ss.laws.StaticKinetic(1.0, 0.5), 0.05, 500.0, 3),
        (ss.laws.StaticKinetic(1.0, 0.5), 0.05, 2.0, 10**6),
    ],
)
def test_the_regime_is_that_of_the_package_where_a_run_ends_early_too(module, law, damping, t_end, max_events):
    system = ss.Oscillator(damping, 0.3, law)
    question = {"t_end": t_end, "x0": [0.0], "v0": None, "max_events": max_events, "per_segment": 20, "samples": 0}
    words, _ = module.ask(ORBIT, {"system": json.loads(system.to_json()), **question})
    assert words["regime"] == ss.simulate(system, t_end, x0=0.0, max_events=max_events).regime()


@pytest.mark.parametrize("name", [name for name in Law.ALL if name not in MOVING])
def test_forces_of_laws_with_an_internal_state_are_those_of_the_package_to_the_bit(module, name):
    law = Law.ALL[name].example()
    t = np.arange(200) / 64
    w = (np.abs(np.arange(200) % 64 - 32.0) - 16.0) / 64
    columns = [t, w, np.zeros_like(t), np.zeros_like(t)]
    _, numbers = module.ask(CURVE, {"law": json.loads(law.to_json())}, columns)
    assert same_bits(numbers, np.concatenate(law.follow(t, w, law.steady_state(w[0])))), STALE


def test_a_measured_motion_goes_in_as_columns_and_gives_the_forces_of_the_package(module):
    law = Law.ALL["BogaczRyczek"].example()
    orbit = ss.simulate(ss.Oscillator(0.35, 0.2, law), 40.0)
    t = np.linspace(0, 40, 801)
    motion = orbit.to_xarray(t)
    stuck = motion["stuck"].to_numpy()
    w = np.where(stuck, 0.0, motion["slip_velocity"].to_numpy())
    rate = np.full_like(t, 0.2)
    _, numbers = module.ask(CURVE, {"law": json.loads(law.to_json())}, [t, w, stuck, rate])
    assert same_bits(numbers, ss.force_along(law, t, w, stuck, rate)), STALE
    with pytest.raises(ValueError, match="columns t, w, stuck and force rate of one length, got 7 numbers"):
        module.ask(CURVE, {"law": json.loads(law.to_json())}, [t[:7]])


#: Rate and state is too stiff for the page, as its example is for the package's integrators.
INTEGRATED = [name for name in Law.ALL if name not in MOVING and name != "RateState"]


@pytest.mark.parametrize("name", INTEGRATED)
def test_a_law_with_an_internal_state_moves_as_the_package_integrates_it(module, name):
    system = ss.Oscillator(0.05, 0.2, Law.ALL[name].example())
    question = {"system": json.loads(system.to_json()), "t_end": 30.0, "max_events": 1, "per_segment": 1}
    words, numbers = module.ask(ORBIT, {**question, "samples": 500})
    assert (words["engine"], words["stop"], words["events"]) == ("integrated", "t_end", 0)
    t, x, v, w, force, mode = numbers.reshape(6, -1)
    known = ss.integrate(system, 30.0)
    size = np.ptp(known.at(t)[0]) + np.ptp(known.at(t)[1])
    assert np.abs(x - known.at(t)[0]).max() < 1e-3 * size
    assert np.abs(v - known.at(t)[1]).max() < 1e-3 * size
    assert np.abs(force - known.to_xarray(t)["force"].to_numpy()).max() < 1e-2 * np.ptp(force)
    assert np.array_equal(mode < 0, np.abs(w) <= 0.01 * np.abs(w).max())
    # The motion goes on from what is integrated, as one that was never interrupted.
    assert len(words["end"]) == 3
    _, later = module.ask(ORBIT, {**question, "samples": 500, "memory": words["end"]})
    further = ss.integrate(system, 60.0)
    assert later.reshape(6, -1)[1, -1] == pytest.approx(float(further.at(60.0)[0]), abs=2e-3 * size)


@pytest.mark.long
def test_the_steady_motion_of_an_integration_is_that_of_the_package(module):
    system = ss.Oscillator(0.05, 0.2, Law.ALL["LuGre"].example())
    look = {"transient": 20.0, "window": 20.0, "tolerance": 1e-3, "surface": None, "points": 4, "max_events": 1}
    question = {"system": json.loads(system.to_json()), "names": ["drive_velocity"], "values": [0.2, 0.4]}
    words, numbers = module.ask(STEADY, {**question, "look": look, "patience": 1000, "chain": True})
    regime, period, _, share, low, high, lasts = numbers[:7]
    diagram = ss.orbit_diagram(system, "drive_velocity", [0.2], direction="fresh", periods=40, keep=20)
    assert words["regimes"][int(regime)] == str(diagram["regime"].values[0]) == "stick_slip"
    assert (low, high) == pytest.approx((float(diagram["x_min"][0]), float(diagram["x_max"][0])), rel=1e-4)
    assert (period, lasts) == pytest.approx((1, 8.8040), rel=1e-4)
    assert 0.05 < share < 0.9


def test_a_law_too_stiff_for_the_page_says_so(module):
    system = ss.Oscillator(0.05, 0.2, replace(Law.ALL["LuGre"].example(), stiffness=1e8))
    question = {"system": json.loads(system.to_json()), "t_end": 30.0, "max_events": 1, "per_segment": 1}
    words, _ = module.ask(ORBIT, {**question, "samples": 10})
    assert words["stop"] == "max_seconds"
    assert "too stiff for this page; run the system by stickslip simulate" in words["sentence"]
    with pytest.raises(ValueError, match="no break-away force of its own"):
        module.ask(SURFACE, {"law": json.loads(system.law.to_json()), "stick_times": [0.0], "force_rates": [1.0]})


@pytest.mark.parametrize("law", ["BogaczRyczek", "DwellTime"])
def test_a_motion_carries_on_with_what_friction_remembers(module, law):
    """Cut at any time, in a stick or in a slip, and gone on with: the events are those of the motion that was not cut."""
    system = ss.Oscillator(0.02, 0.2, Law.ALL[law].example())
    document = {"system": json.loads(system.to_json()), "max_events": 10**6, "per_segment": 1, "samples": 0}
    whole = rows(ss.simulate(system, 90.0, x0=0.3))
    for cut in (17.0, 21.0, 24.5, 27.3, 30.0):
        words, _ = module.ask(ORBIT, {**document, "t_end": cut, "x0": [0.3]})
        words, numbers = module.ask(ORBIT, {**document, "t_end": 90.0 - cut, "memory": words["end"]})
        later = numbers[words["samples"] * 6 :].reshape(-1, 8)
        known = whole[whole[:, 0] > cut]
        assert len(later) == len(known) > 3
        assert np.array_equal(later[:, 1], known[:, 1])
        np.testing.assert_allclose(later[:, 0] + cut, known[:, 0], rtol=1e-9)
        np.testing.assert_allclose(later[:, 5:], known[:, 5:], rtol=1e-8, atol=1e-10)
        assert numbers[: words["samples"]].min() >= 0.0


@pytest.mark.parametrize("preset", ["brake", "bow", "wiper"])
def test_columns_that_repeat_early_are_those_that_go_all_the_way(module, preset):
    state = presets()[preset]["state"]
    span = {"low": 0.02, "high": 0.6, **state.get("diagram", {})}
    look = {"transient": 60.0, "window": 40.0, "tolerance": 1e-6, "surface": None, "points": 2, "max_events": 10**5}
    question = {
        "system": state["system"],
        "names": ["drive_velocity"],
        "values": np.linspace(span["low"], span["high"], 12).tolist(),
    }
    found = []
    for early in (0.0, 12.0):
        _, numbers = module.ask(STEADY, {**question, "look": {**look, "early": early}, "chain": True, "patience": 1000})
        rows = []
        while len(numbers):
            section, turns = (int(count) for count in numbers[8:10])
            rows.append(numbers[[0, 1, 4, 5]])
            numbers = numbers[10 + 2 * section + turns :]
        found.append(np.array(rows))
    assert found[0].shape == (12, 4)
    np.testing.assert_allclose(*found, rtol=1e-5, atol=1e-9)


def test_masses_in_a_row_give_the_same_bits(module):
    system = ss.chain(3, Law.ALL["BogaczRyczek"].example(), 0.2)
    question = {
        "system": json.loads(system.to_json()),
        "t_end": 30.0,
        "max_events": 10**7,
        "per_segment": 1,
        "samples": 0,
    }
    words, numbers = module.ask(ORBIT, question)
    events = numbers[words["samples"] * (1 + 2 * 3 + 3 * 3) :].reshape(-1, 8)
    assert same_bits(events, rows(ss.simulate(system, 30.0))), STALE


def test_an_orbit_diagram_is_that_of_the_package_to_the_bit(module):
    system = ss.paper.oscillator(0.2)
    values = np.linspace(0.1, 0.5, 9)
    look = {
        "transient": 60.0,
        "window": 40.0,
        "tolerance": 1e-6,
        "surface": None,
        "decide": 0,
        "points": 24,
        "max_events": 10**6,
    }
    question = {
        "system": json.loads(system.to_json()),
        "names": ["drive_velocity"],
        "values": values.tolist(),
        "look": look,
    }
    # From value to value, as the page goes: fresh starts go in lanes in the package, which have other bits.
    words, numbers = module.ask(STEADY, {**question, "chain": True, "patience": 10**6})
    diagram = ss.orbit_diagram(system, "drive_velocity", values, direction="up", periods=100, keep=40, points=24)
    regimes, at = [], 0
    for column in range(len(values)):
        regime, period, _, _, low, high, _, _, section, turns = numbers[at : at + 10]
        regimes.append(words["regimes"][int(regime)])
        assert (period, low, high) == tuple(diagram[name].values[column] for name in ("period", "x_min", "x_max")), (
            STALE
        )
        at += 10 + 2 * int(section) + int(turns)
    assert regimes == diagram["regime"].values.tolist()
    assert at == len(numbers)


@pytest.mark.parametrize("name", ["StaticKinetic", "PiecewiseLinear"])
def test_a_map_in_lanes_is_that_of_the_package_to_the_bit(module, name):
    system = ss.Oscillator(0.05, 0.3, Law.ALL[name].example(), forcing=ss.Harmonic(0.5, 0.7))
    amplitudes, frequencies = np.meshgrid(np.linspace(0.02, 1.6, 11), np.linspace(0.3, 2.3, 9))
    values = np.column_stack([amplitudes.ravel(), frequencies.ravel()]).ravel()
    names = ["forcing.0.amplitude", "forcing.0.frequency"]
    look = {"transient": 60.0, "window": 40.0, "tolerance": 1e-6, "surface": None, "points": 24, "max_events": 10**6}
    question = {"system": json.loads(system.to_json()), "names": names, "values": values.tolist(), "look": look}
    _, numbers = module.ask(STEADY, {**question, "patience": 1000})
    table = _core.sweep(system.to_json(), names, values, json.dumps(look), False, None, None, None)
    whole = [table[name] for name in ("regime", "period", "chaos", "stuck_share", "x_min", "x_max", "period_time")]
    at = 0
    for row, sought in enumerate(np.column_stack(whole)):
        section, turns = (int(count) for count in numbers[at + 8 : at + 10])
        assert same_bits(numbers[at : at + 7], sought), STALE
        assert same_bits(numbers[at + 10 : at + 10 + 2 * section : 2], table["section_x"][row][:section]), STALE
        at += 10 + 2 * section + turns
    assert at == len(numbers)
    # Who has no patience gets an answer too.
    words, numbers = module.ask(STEADY, {**question, "patience": 1})
    assert words["regimes"][int(numbers[0])] == "unfinished"


def test_the_largest_exponent_is_that_of_the_package(module):
    """The paper's chaotic motion: both follow the same phases, the package with as many directions as there are."""
    system = ss.paper.oscillator(0.3, forcing=ss.Harmonic(0.03, 1.25))
    t_end = 150 * 2 * np.pi / 1.25
    question = {"system": json.loads(system.to_json()), "t_end": t_end, "max_events": 10**6, "transient": 0.2}
    _, (exponent, error) = module.ask(LYAPUNOV, question)
    known = ss.lyapunov(system, t_end, transient=0.2)
    assert exponent == pytest.approx(known.exponents[0], rel=1e-6)
    assert error == pytest.approx(known.errors[0], rel=1e-6)
    assert exponent > 3 * error > 0


def test_a_varying_normal_force_and_a_stop_give_the_same_bits(module):
    law = ss.laws.StaticKinetic(1.0, 0.6)
    normal = ss.NormalForce(harmonics=ss.Harmonic(0.3, 0.7), position=0.2)
    system = ss.Oscillator(0.05, 0.2, law, normal_force=normal, springs=ss.Spring.stop(0.5, 40.0))
    state = content_of_system(system, 40.0)["state"]["system"]
    question = {"t_end": 40.0, "x0": [0.3], "max_events": 10**7, "per_segment": 1, "samples": 0}
    words, numbers = module.ask(ORBIT, {"system": state, **question})
    events = numbers[words["samples"] * 6 :].reshape(-1, 8)
    here = rows(ss.simulate(system, 40.0, x0=0.3))
    assert len(here) > 20
    assert same_bits(events, here), STALE


def test_the_module_refuses_with_the_sentences_of_the_package(module):
    system = json.loads(ss.paper.oscillator(0.2).to_json())
    run = {"t_end": 10.0, "max_events": 1000, "per_segment": 1, "samples": 0}
    for change in (
        {"mass": -1.0},
        {"damping": -0.5},
        {"law": {"type": "StaticKinetic", "break_away": 0.5, "kinetic": 0.6}},
    ):
        with pytest.raises(ValueError, match="must") as here:
            _core.System(json.dumps(system | change))
        with pytest.raises(ValueError, match=re.escape(str(here.value))):
            module.ask(ORBIT, {"system": system | change, **run})
    with pytest.raises(ValueError, match="expected the number of a question from 0 to 5, got 9"):
        module.ask(9, {})
    with pytest.raises(ValueError, match="its motion has no derivative here"):
        module.ask(
            LYAPUNOV,
            {"system": system | {"law": json.loads(Law.ALL["LuGre"].example().to_json())}, **run, "transient": 0.2},
        )
    # What was refused leaves the module as it was.
    assert module.ask(ORBIT, {"system": system, **run})[0]["stop"] == "t_end"


def test_the_script_is_that_of_its_sources():
    total = hashlib.sha256()
    folder = ROOT / "web" / "src"
    for path in sorted(folder.rglob("*.ts"), key=lambda path: path.relative_to(folder).as_posix()):
        total.update(f"{path.relative_to(folder).as_posix()}\n".encode() + path.read_bytes())
    for script in ("explorer.js", "boot.js"):
        stored = (SHIPPED / script).read_text(encoding="utf-8").partition("\n")[0].split()[-1]
        assert stored == total.hexdigest(), f"web/src changed since {script} was made: run make explorer"


def test_the_shipped_files_name_no_machine_and_no_network():
    core = lzma.decompress((SHIPPED / "core.wasm.lzma").read_bytes())
    assert core.startswith(b"\0asm")
    for word in (b"/root", b"/home", b"/Users", b"crates.io", b".cargo", str(ROOT).encode()):
        assert word not in core
    script = (SHIPPED / "explorer.js").read_text(encoding="utf-8")
    for word in ("http://", "https://", "eval(", "innerHTML", "new Function"):
        assert word not in script
    assert "</script" not in script


def test_the_page_is_whole_and_asks_no_network():
    text = page()
    assert not re.findall(r"(?:src|href)=", text.partition('id="data">')[0])
    assert 'null</script>\n<script type="application/octet-stream"' in text  # no state: the first preset
    assert len(text.encode()) <= 450_000


@pytest.mark.parametrize("name", Law.ALL)
def test_every_number_of_every_law_stands_on_the_page(name):
    law = laws()[name]
    assert law["sentence"]
    document = Law.ALL[name].example()
    assert Law.from_dict({key: value for key, value in law["example"].items() if value is not None}) == document
    for number in law["numbers"]:
        value = law["example"]
        for key in number["path"].split("."):
            value = value[key]
        assert number["symbol"]
        assert number["words"]
        if isinstance(value, float):
            assert number["low"] <= value <= number["high"]


def test_symbols_are_those_of_the_documentation():
    symbols = {name: {row["path"]: row["symbol"] for row in law["numbers"]} for name, law in laws().items()}
    assert symbols["DwellTime"] == {"kinetic": "fₖ", "limit": "Δ∞", "rate": "γ", "exponent": "m"}
    assert symbols["ElastoPlastic"]["stiffness"] == symbols["LuGre"]["stiffness"] == "σ₀"
    assert symbols["BogaczRyczek"]["static_friction.drop_scale"] == "δ₁"
    assert [row["symbol"] for row in oscillator()] == ["s", "D", "k", "m"]


def test_names_and_words_hold_no_source_text():
    pages = [*oscillator(), *(row for law in laws().values() for row in law["numbers"])]
    assert [row for row in pages if re.search(r"`|None|:class:", row["name"] + row["words"])] == []


def law_of(document):
    """The law that a document of the page means: a pencil that is not there lies at infinity."""
    at_infinity = {"D": "infinity"} if document["type"] == "BogaczRyczek" and document["D"] is None else {}
    return Law.from_dict({key: value for key, value in document.items() if value is not None} | at_infinity)


@pytest.mark.parametrize(("name", "row"), described_presets().items())
def test_a_preset_has_a_source_and_moves_as_it_says(name, row):
    state = presets()[name]["state"]
    law = law_of(state["system"]["law"])
    numbers = {key: state["system"][key] for key in ("damping", "drive_velocity", "mass", "stiffness")}
    if "chain" in state:
        system = ss.chain(state["chain"]["masses"], law, numbers["drive_velocity"], damping=numbers["damping"])
    else:
        forcing = [ss.Harmonic(**one) for one in state["system"]["forcing"]]
        system = ss.Oscillator(law=law, forcing=forcing, **numbers)
    orbit = ss.simulate(system, state["t_end"])
    assert orbit.stop == "t_end"
    assert row["source"]
    checked = row["checked"]
    assert str(orbit.regime()) == checked["regime"]
    x = np.asarray(orbit.at(np.linspace(0.5, 1, 4001) * orbit.t_end)[0])
    x = x[:, 0] if x.ndim > 1 else x
    assert np.ptp(x) / 2 == pytest.approx(checked["amplitude"], rel=1e-5, abs=1e-6)


def test_devices_have_their_units():
    units = {name: preset["state"].get("units", {}).get("force") for name, preset in presets().items()}
    assert {name: unit for name, unit in units.items() if unit} == {"drill": "N m", "bow": "N"}


def test_the_figures_of_the_paper_stand_among_the_presets():
    shown = " ".join(f"{row['title']} {row['source']}" for row in described_presets().values())
    for number in range(2, 15):
        assert f"Fig. {number}" in shown
    amplitudes = {name: row["checked"]["amplitude"] for name, row in described_presets().items()}
    # D moved up makes the limit cycle larger (Fig. 10), a faster belt smaller (Fig. 5).
    assert amplitudes["fig-10"] > amplitudes["almost-harmonic"] > amplitudes["fig-5"]


def test_files_become_states(tmp_path):
    system = ss.paper.oscillator(0.3, forcing=ss.Harmonic(0.03, 1.25))
    (tmp_path / "system.toml").write_text(system.to_toml() + "\n[simulation]\nt_end = 77.0\nx0 = 0.5\n")
    state = content_of(tmp_path / "system.toml")["state"]
    assert (state["t_end"], state["start"]["x0"], state["system"]["drive_velocity"]) == (77.0, [0.5], 0.3)
    assert state["system"]["forcing"] == [{"amplitude": 0.03, "frequency": 1.25, "phase": 0.0}]
    assert state["system"]["law"] == full(system.law)
    assert (state["system"]["normal_force"], state["system"]["springs"]) == (None, [])

    ss.simulate(system, 50.0, x0=0.25).save(tmp_path / "orbit.nc")
    state = content_of(tmp_path / "orbit.nc")["state"]
    assert (state["t_end"], state["start"]["x0"], state["system"]["drive_velocity"]) == (50.0, [0.25], 0.3)

    (tmp_path / "law.toml").write_text('[law]\ntype = "Coulomb"\nkinetic = 0.4\n')
    assert content_of(tmp_path / "law.toml")["state"]["system"]["law"] == {"type": "Coulomb", "kinetic": 0.4}


def test_files_that_the_page_cannot_show_are_refused_with_a_sentence(tmp_path):
    law = Law.ALL["Coulomb"].example()
    (tmp_path / "two.toml").write_text(ss.chain(2, law, 0.2).to_toml())
    with pytest.raises(ss.InputError, match="expected a system of one mass, got 2 masses"):
        content_of(tmp_path / "two.toml")["state"]
    wave = ss.Drive(0.2, harmonics=[ss.Harmonic(0.1, 1.0)])
    (tmp_path / "wave.toml").write_text(ss.Oscillator(0.1, wave, law).to_toml())
    with pytest.raises(ss.InputError, match="expected a constant drive velocity"):
        content_of(tmp_path / "wave.toml")["state"]


def test_the_command_writes_the_page(tmp_path):
    (tmp_path / "law.toml").write_text('[law]\ntype = "Coulomb"\nkinetic = 0.4\n')
    command = [sys.executable, "-m", "stickslip", "explore", "law.toml", "-o", "page.html", "--no-browser"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    assert (
        '"type":"Coulomb","kinetic":0.4'
        in (tmp_path / "page.html").read_text(encoding="utf-8").partition('id="state"')[2]
    )


def test_a_state_cannot_end_the_element_it_stands_in():
    text = page({"preset": "</script><script>alert(1)</script>"})
    assert "<script>alert" not in text
