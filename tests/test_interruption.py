"""A long run ends by Ctrl-C, at once, and by a limit of time, with the orbit so far."""

from __future__ import annotations

import contextlib
import importlib
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
import xarray as xr
from evidence import script

import stickslip as ss
from stickslip import show
from stickslip.cli.main import main
from stickslip.dynamics.continuation import loci, walk
from stickslip.errors import UnfinishedWarning

FOREVER = 10**9
MANY = 2**62


def long_run(engine):
    """An oscillator or system whose run to FOREVER would take hours."""
    match engine:
        case "closed form":
            return ss.paper.oscillator(0.2, ss.Harmonic(0.1, 0.7))
        case "network":
            return ss.chain(3, ss.laws.StaticKinetic(1.0, 0.6), 0.2)
        case "smooth":
            return ss.Oscillator(0.0, 0.2, ss.laws.Rational(1.0, 3.0))
        case "integration":
            return ss.Oscillator(0.0, 0.1, ss.laws.LuGre(1e3, 30.0, 0.4, kinetic=1.0, break_away=1.5, scale=1e-2))
        case "one slip":
            return ss.Oscillator(0.1, -5.0, ss.laws.Coulomb(0.1), forcing=ss.Harmonic(0.01, 1.3))
        case "one stick":
            return ss.Oscillator(0.1, 0.0, ss.laws.DwellTime(1.0, 0.5, 0.1), forcing=ss.Harmonic(0.9, 1.0))
        case "fast forcing":
            return ss.Oscillator(0.1, 0.3, ss.paper.oscillator(0.3).law, forcing=ss.Harmonic(0.1, 1e9))


ENGINES = ["closed form", "network", "smooth", "integration", "one slip", "one stick", "fast forcing"]


@pytest.mark.parametrize("engine", ENGINES)
def test_a_run_ends_after_max_seconds_with_the_orbit_so_far(engine):
    system = long_run(engine)
    begin = time.monotonic()
    orbit = ss.simulate(system, FOREVER, max_events=MANY, max_seconds=0.1)
    # Loaded machines sleep; an hour would show all the same.
    assert 0.1 <= time.monotonic() - begin < 20
    assert orbit.stop == "max_seconds"
    assert orbit.stop_sentence == "the run stopped after max_seconds: raise max_seconds to go on"
    assert 0 < orbit.t_end < FOREVER
    # What was found is what a run to that time finds.
    known = min(orbit.t_end, 50.0)
    t = np.linspace(0, known, 100)
    whole = ss.simulate(system, known)
    assert orbit.at(t)[0] == pytest.approx(whole.at(t)[0], abs=1e-8)


def test_a_run_that_is_done_in_time_is_the_same_run():
    system = long_run("closed form")
    assert ss.simulate(system, 100, max_seconds=60).events.equals(ss.simulate(system, 100).events)


@pytest.mark.parametrize("seconds", [0, -1.0, float("nan")])
def test_max_seconds_must_be_positive(seconds):
    with pytest.raises(ss.InputError, match="max_seconds must be"):
        ss.simulate(long_run("closed form"), 10, max_seconds=seconds)


@pytest.mark.parametrize("engine", ["closed form", "network", "one slip"])
def test_a_batch_ends_after_max_seconds_with_every_run_where_it_is(engine):
    begin = time.monotonic()
    runs = ss.simulate_many(
        long_run(engine), {"damping.0.0" if engine == "network" else "damping": np.linspace(0.1, 0.2, 600)},
        FOREVER, max_events=MANY, max_seconds=0.2, workers=2,
    )  # fmt: skip
    assert time.monotonic() - begin < 20
    assert (runs["stop"] == "max_seconds").all()
    assert np.isfinite(runs["x"]).all()


@pytest.mark.parametrize("engine", ["closed form", "smooth", "one slip"])
def test_a_section_ends_after_max_seconds(engine):
    begin = time.monotonic()
    points = ss.section(long_run(engine), "maximum", t_end=FOREVER, transient=0.0, max_events=MANY, max_seconds=0.2)
    assert time.monotonic() - begin < 40
    assert points.attrs["stop"] == "max_seconds"


def test_the_command_line_ends_after_max_seconds(tmp_path, capsys):
    file = tmp_path / "slip.toml"
    file.write_text(
        "mass = 1.0\nstiffness = 1.0\ndamping = 0.1\ndrive_velocity = 5.0\n"
        '[law]\ntype = "Coulomb"\nkinetic = 0.1\n[forcing]\namplitude = 0.01\n'
        "frequency = 1.3\n[simulation]\nt_end = 1e9\nv0 = 0.0\nmax_seconds = 0.2\n"
    )
    begin = time.monotonic()
    assert main(["simulate", str(file)]) == 0
    assert time.monotonic() - begin < 20
    assert "the run stopped after max_seconds" in capsys.readouterr().out


def test_what_would_fill_the_memory_is_refused_before():
    system = long_run("closed form")
    with pytest.raises(ss.InputError, match=r"at most 4 GiB, got one of 44\.7 GiB; lower keep"):
        ss.simulate_many(system, {"x0": [0.0, 0.1]}, 10, section="release", keep=10**9)
    with pytest.raises(ss.InputError, match="whole number"):
        ss.simulate_many(system, {"x0": [0.0, 0.1]}, 10, section="release", keep=10**30)
    with pytest.raises(ss.InputError, match=r"at most 4 GiB, got one of .* GiB; lower points"):
        ss.orbit_diagram(system, "drive_velocity", [0.1, 0.2], points=10**9)
    with pytest.raises(ss.InputError, match="from 500 to 10000"):
        ss.orbit_diagram(system, "drive_velocity", [0.1, 0.2], decide=10**9)


@pytest.mark.slow
def test_an_orbit_ends_where_it_fills_the_memory():
    orbit = ss.simulate(long_run("smooth"), FOREVER, max_events=MANY)
    assert orbit.stop == "memory"
    assert orbit.stop_sentence.startswith("the run stopped as its orbit takes 1 GiB of memory")
    assert np.isfinite(orbit.at(orbit.t_end)).all()


def test_a_run_that_ends_before_its_transient_shows_nothing():
    # The dense output of an integrator says anything beyond its end.
    system = long_run("integration")
    with pytest.warns(UnfinishedWarning, match="2 of 2 runs"):
        rows = ss.orbit_diagram(system, "drive_velocity", [0.05, 0.1], periods=FOREVER, max_seconds=0.3)
    assert set(rows["regime"].to_numpy()) == {"unfinished"}
    for name in ("x_min", "x_max", "w_min", "w_max", "section_x"):
        assert np.isnan(rows[name].to_numpy()).all()


CHILD = """
import signal, sys, time

signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background of a shell is born deaf to it
import numpy as np
import pandas, xarray  # not while a run is to be interrupted

import stickslip as ss
from stickslip import show
from stickslip.dynamics.periodic.event_sequence import EventSequence
from test_interruption import FOREVER, MANY, long_run


def run(engine, t_end):
    match engine:
        case "batch":
            system = ss.paper.oscillator(0.2)
            over = {"drive_velocity": np.linspace(0.1, 0.2, 8)}
            ss.simulate_many(system, over, t_end, max_events=10**10, workers=2)
        case "batch that asks seldom":
            # 64 steps of so many masses take longer than the thread that watches waits between two looks at the signals.
            many = ss.chain(300, ss.laws.StaticKinetic(1.0, 0.6), 0.2)
            ss.simulate_many(many, {"x0.0": [0.0]}, t_end, max_events=10**10, workers=1)
        case "section":
            ss.section(long_run("closed form"), "release", t_end=t_end, max_events=MANY)
        case "sweep":
            system = long_run("closed form")
            ss.orbit_diagram(system, "drive_velocity", [0.2, 0.3], periods=int(100 + t_end), workers=2)
        case "sweep of a smooth law":
            system = long_run("smooth")
            ss.orbit_diagram(system, "drive_velocity", [0.2, 0.3], periods=int(100 + t_end), workers=2)
        case "sweep of integrations":
            # Stick-slip: steady slip is integrated in few steps, however long it lasts.
            system = long_run("integration")
            ss.orbit_diagram(system, "drive_velocity", [0.05, 0.1], periods=int(100 + t_end), workers=2)
        case "derivatives":
            EventSequence.of_run(long_run("one slip"), t_end)
        case _:
            ss.simulate(long_run(engine), t_end, max_events=MANY)


for line in sys.stdin:
    engine = line.strip()
    run(engine, 1e-6)  # everything is imported
    try:
        # Whoever reads this may interrupt before a busy machine gets any further.
        print("ready", flush=True)
        run(engine, FOREVER)
    except KeyboardInterrupt:
        stopped = time.monotonic()
        # Nothing else is lost.
        print("interrupted", stopped, len(ss.simulate(long_run("closed form"), 50.0).events), flush=True)
"""


@pytest.fixture(scope="module")
def child(request):
    """One process for all: starting it takes longer than the tests, and it has to live on after each Ctrl-C."""
    process = subprocess.Popen(
        [sys.executable, "-c", CHILD],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=request.path.parent,
    )
    yield process
    process.kill()
    process.communicate()


@pytest.mark.parametrize(
    "engine",
    [
        *ENGINES,
        "batch",
        "section",
        "sweep",
        *(
            pytest.param(name, marks=pytest.mark.long)
            for name in ("batch that asks seldom", "sweep of a smooth law", "sweep of integrations")
        ),
        "derivatives",
    ],
)
def test_ctrl_c_ends_a_run_at_once(engine, child):
    child.stdin.write(f"{engine}\n")
    child.stdin.flush()
    assert child.stdout.readline() == "ready\n"
    time.sleep(0.2)
    sent = time.monotonic()
    child.send_signal(signal.SIGINT)
    deaf = threading.Timer(60, child.kill)
    deaf.start()
    said = child.stdout.readline()
    deaf.cancel()
    word, stopped, events = said.split()
    assert word == "interrupted"
    # 0.05 s on an idle machine; the run itself would take hours.
    assert float(stopped) - sent < 30
    assert int(events) == len(ss.simulate(long_run("closed form"), 50.0).events)


evidence = script("interruption")


@pytest.mark.parametrize(
    "name",
    [
        "regime_map",
        "basins",
        "lyapunov, closed form",
        "periodic_orbit, closed form",
        "continuation",
        "critical_velocities",
        "sensitivities",
    ],
)
def test_ctrl_c_ends_what_is_made_of_many_runs(name):
    _, run = evidence.runs()[name]
    # Of the processor, whatever else the machine does.
    assert evidence.after_a_signal(run, lead=0.05) < 1


def test_sweeps_end_after_max_seconds_and_a_store_goes_on(tmp_path):
    smooth = ss.Oscillator(0.05, 0.1, ss.laws.ExponentialStribeck(1.0, 0.6, 0.1))
    began = time.monotonic()
    with pytest.warns(
        UnfinishedWarning, match="regime_map: 4 of 4 runs ended after max_seconds and are unfinished; raise"
    ):
        chart = ss.regime_map(smooth, {"damping": np.linspace(0.01, 0.1, 4)}, transient=1e6, max_seconds=0.3)
    # A run of a million periods takes minutes.
    assert time.monotonic() - began < 20
    assert set(chart["stop"].to_numpy()) == {"max_seconds"}
    assert set(chart["regime"].to_numpy()) == {"unfinished"}
    assert np.isnan(chart["x_max"]).all()
    ask = {"x": [0.0, 0.5], "v": [0.0, 0.1], "transient": 40, "window": 8, "store": tmp_path / "basins.zarr"}
    with pytest.warns(UnfinishedWarning, match="4 of 4 runs .* again with the same store"):
        cut = ss.basins(smooth, **ask, max_seconds=1e-6)
    legend = show.basins_plot(cut).get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["unfinished (100 %)"]
    assert (cut["label"] == -1).all()
    whole = ss.basins(smooth, **ask)
    assert whole["attractor_regime"].values.tolist() == ["stick_slip"]
    assert (whole["stop"] == "t_end").all()
    with pytest.raises(ss.InputError, match="max_seconds must be greater than 0"):
        ss.orbit_diagram(smooth, "damping", [0.1], max_seconds=0)


@pytest.mark.slow
def test_the_command_line_ends_sweeps_too(tmp_path, capsys):
    system = tmp_path / "system.toml"
    system.write_text(ss.Oscillator(0.05, 0.1, ss.laws.ExponentialStribeck(1.0, 0.6, 0.1)).to_toml())
    ask = [
        "sweep",
        str(system),
        "--over",
        "damping=0.01,0.02",
        "--transient",
        "1000000",
        "--max-seconds",
        "0.2",
        "--json",
    ]
    assert main(ask) == 0
    out, err = capsys.readouterr()
    assert '"unfinished": 1' in out
    assert err.startswith("stickslip: sweep: 2 of 2 runs ended after max_seconds and are unfinished; raise")
    assert err.count("\n") == 1


@pytest.mark.long
def test_continue_keeps_what_it_has_at_ctrl_c(tmp_path, monkeypatch, capsys):
    belt = ss.Oscillator(0.05, 0.3, ss.laws.ExponentialStribeck(1.0, 0.5, 0.4))
    (tmp_path / "belt.toml").write_text(belt.to_toml())
    output, kept = tmp_path / "branches.nc", tmp_path / "branches.partial.nc"
    command = ["continue", str(tmp_path / "belt.toml"), "--over", "drive_velocity=0.28:0.32", "-o", str(output)]

    def ctrl_c_at(point):
        made = []
        real = walk.stepped

        def stepped(*arguments):
            made.append(1)
            if len(made) == point:
                raise KeyboardInterrupt
            return real(*arguments)

        monkeypatch.setattr(walk, "stepped", stepped)

    ctrl_c_at(8)
    assert main(command) == 130
    said = capsys.readouterr()
    assert f"interrupted; what was found by then is written to {kept}" in said.err
    assert "cut off by Ctrl-C" in said.out
    assert not output.exists()
    with xr.open_dataset(kept) as branches:
        assert branches.attrs["interrupted"] == 1
        assert branches["cut"].values.tolist() == ["", "interrupt"]
        cycles = branches["drive_velocity"].isel(branch=1).dropna("point")
    # In Python it is the interrupt that has them, and the points are those of a search that is not interrupted.
    ctrl_c_at(8)
    with pytest.raises(KeyboardInterrupt) as stop:
        ss.continuation(belt, "drive_velocity", (0.28, 0.32))
    assert stop.value.result.branches[1].values == cycles.values.tolist()
    monkeypatch.undo()
    whole = ss.continuation(belt, "drive_velocity", (0.28, 0.32), seeds=0)
    assert len(cycles) > 3
    assert set(cycles.values.tolist()) < set(whole.branches[1].values)


@pytest.mark.long
@pytest.mark.parametrize("kind", [pytest.param("hopf", marks=pytest.mark.slow), "crossing_sliding"])
def test_a_locus_keeps_what_it_has_at_ctrl_c(kind, tmp_path, monkeypatch, capsys):
    if kind == "hopf":
        system = ss.Oscillator(0.1, 1.0, ss.laws.ExponentialStribeck(1.0, 0.5, 0.5))
        ranges, step = {"drive_velocity": (1.0, 1.3), "damping": (0.05, 0.15)}, "steady_slip"
    else:
        system = ss.Oscillator(0.0, 0.0, ss.laws.Coulomb(0.6), forcing=ss.Harmonic(1.0, 0.7))
        ranges, step = {"law.kinetic": (0.55, 0.75), "forcing.frequency": (0.65, 0.75)}, "stepped"
    (first, bounds), (second, others) = ranges.items()
    (point,) = (item for item in ss.continuation(system, first, bounds, seeds=0).special_points if item.kind == kind)
    whole = ss.locus(point, (first, second), (bounds, others))
    real = getattr(loci, step)

    def ctrl_c_at(calls):
        made = []

        def stopped(*arguments):
            made.append(1)
            if len(made) == calls:
                raise KeyboardInterrupt
            return real(*arguments)

        monkeypatch.setattr(loci, step, stopped)

    ctrl_c_at(100 if kind == "hopf" else 7)
    with pytest.raises(KeyboardInterrupt) as stop:
        ss.locus(point, (first, second), (bounds, others))
    curve = stop.value.result
    assert (curve.kind, curve.cut, whole.cut) == (kind, "interrupt", "")
    assert 3 < len(curve.values) < len(whole.values)
    assert {*map(tuple, curve.values.tolist())} < {*map(tuple, whole.values.tolist())}
    # The command keeps it beside its branches.
    (tmp_path / "system.toml").write_text(system.to_toml())
    spans = [f"{name}={low}:{high}" for name, (low, high) in ranges.items()]
    ctrl_c_at(100 if kind == "hopf" else 7)
    output = ["-o", str(tmp_path / "loci.nc")]
    assert main(["continue", str(tmp_path / "system.toml"), "--over", spans[0], "--and", spans[1], *output]) == 130
    assert "points, " in (said := capsys.readouterr().out)
    assert "cut off by Ctrl-C" in said
    with xr.open_dataset(tmp_path / "loci.partial.nc") as kept:
        assert kept["locus_cut"].values.tolist()[-1] == "interrupt"


def test_progress_is_said_while_the_first_orbit_is_sought():
    said = []
    belt = ss.Oscillator(0.05, 0.3, ss.laws.ExponentialStribeck(1.0, 0.5, 0.4))
    ss.continuation(belt, "drive_velocity", (0.295, 0.305), seeds=0, progress=lambda *points: said.append(points))
    first = said.index((1, 300))
    assert first > 1
    assert said[:first] == [(0, 300)] * first


def test_a_command_that_is_asked_to_end_says_so(capsys, monkeypatch):
    module = importlib.import_module("stickslip.cli.main")

    @contextlib.contextmanager
    def asked(_targets):
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(1)
        yield

    before = signal.getsignal(signal.SIGTERM)
    monkeypatch.setattr(module, "keeping_inputs", asked)
    assert module.main(["schema", "system"]) == 130
    assert capsys.readouterr().err == "stickslip: interrupted\n"
    assert signal.getsignal(signal.SIGTERM) == before
