"""A long run ends by Ctrl-C, at once, and by a limit of time, with the orbit so far."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import stickslip as ss

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


ENGINES = ["closed form", "network", "smooth", "integration"]


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
    t = np.linspace(0, min(orbit.t_end, 50.0), 100)
    whole = ss.simulate(system, 50.0)
    assert orbit.at(t)[0] == pytest.approx(whole.at(t)[0], abs=1e-8)


def test_a_run_that_is_done_in_time_is_the_same_run():
    system = long_run("closed form")
    assert ss.simulate(system, 100, max_seconds=60).events.equals(ss.simulate(system, 100).events)


@pytest.mark.parametrize("seconds", [0, -1.0, float("nan")])
def test_max_seconds_must_be_positive(seconds):
    with pytest.raises(ss.InputError, match="max_seconds must be"):
        ss.simulate(long_run("closed form"), 10, max_seconds=seconds)


CHILD = """
import signal, sys, time

signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background of a shell is born deaf to it
from test_interruption import FOREVER, MANY, long_run
import stickslip as ss
import numpy as np

engine = sys.argv[1]
system = long_run("closed form" if engine in ("batch", "section") else engine)
ss.simulate(system, 1.0)  # everything is imported
print("ready", flush=True)
try:
    if engine == "batch":
        system = ss.paper.oscillator(0.2)
        ss.simulate_many(system, {"drive_velocity": np.linspace(0.1, 0.2, 8)}, FOREVER, max_events=10**10, workers=2)
    elif engine == "section":
        ss.section(system, "release", t_end=FOREVER, max_events=MANY)
    else:
        ss.simulate(system, FOREVER, max_events=MANY)
except KeyboardInterrupt:
    stopped = time.monotonic()
    # Nothing else is lost.
    print("interrupted", stopped, len(ss.simulate(long_run("closed form"), 50.0).events), flush=True)
"""


@pytest.mark.parametrize("engine", [*ENGINES, "batch", "section"])
def test_ctrl_c_ends_a_run_at_once(engine, request):
    child = subprocess.Popen(
        [sys.executable, "-c", CHILD, engine], stdout=subprocess.PIPE, text=True, cwd=request.path.parent
    )
    try:
        assert child.stdout.readline() == "ready\n"
        time.sleep(0.2)
        sent = time.monotonic()
        child.send_signal(signal.SIGINT)
        out, _ = child.communicate(timeout=60)
    finally:
        child.kill()
    word, stopped, events = out.split()
    assert word == "interrupted"
    assert float(stopped) - sent < 5  # 0.05 s on an idle machine
    assert int(events) == len(ss.simulate(long_run("closed form"), 50.0).events)
