"""How soon a long run ends by Ctrl-C and by max_seconds; writes docs/evidence/interruption.md.

    python docs/evidence/interruption.py [--repeats N]

Ends with code 1 where anything takes longer than a second.
"""

from __future__ import annotations

import argparse
import inspect
import os
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import stickslip as ss
from stickslip.dynamics.periodic.derivatives import sensitivities
from stickslip.dynamics.periodic.event_sequence import EventSequence

PAGE = Path(__file__).with_name("interruption.md")
#: Longer than any run takes, events without end, and the processor time after which the signal comes.
FOREVER, MANY, LEAD = 1e9, 2**62, 0.3
HEAD = """# How soon a run ends

Each of these would run for hours. *Ctrl-C*: the processor time from a signal, which comes {lead:g} s after the start, to the
`KeyboardInterrupt`. *max_seconds*: the processor time of a whole run that is limited to a millisecond. The largest of
{repeats} repetitions, in seconds; the time of the processor is that of the clock on an idle machine, and other work does not
change it. A dash: the function takes no limit of time, Ctrl-C ends it.

Written by `python docs/evidence/interruption.py --repeats {repeats}`.

| run | Ctrl-C | max_seconds |
|---|---:|---:|
"""


def systems() -> dict[str, Any]:
    """Systems whose runs to FOREVER take hours, by the engine and what is hard for it."""
    paper = ss.paper.oscillator(0.2)
    return {
        "closed form": ss.paper.oscillator(0.2, ss.Harmonic(0.1, 0.7)),
        "network": ss.chain(3, ss.laws.StaticKinetic(1.0, 0.6), 0.2),
        "smooth": ss.Oscillator(0.0, 0.2, ss.laws.Rational(1.0, 3.0)),
        "integration": ss.Oscillator(0.0, 0.1, ss.laws.LuGre(1e3, 30.0, 0.4, kinetic=1.0, break_away=1.5, scale=1e-2)),
        "one slip": ss.Oscillator(0.1, -5.0, ss.laws.Coulomb(0.1), forcing=ss.Harmonic(0.01, 1.3)),
        "one stick": ss.Oscillator(0.1, 0.0, ss.laws.DwellTime(1.0, 0.5, 0.1), forcing=ss.Harmonic(0.9, 1.0)),
        "fast forcing": ss.Oscillator(0.1, 0.3, paper.law, forcing=ss.Harmonic(0.1, 1e9)),
    }


def runs() -> dict[str, tuple[Callable[..., Any], Callable[..., Any]]]:
    """What is called, and how: ``run(t_end, **limit)``."""
    found: dict[str, tuple[Callable[..., Any], Callable[..., Any]]] = {}
    known = systems()
    closed = known["closed form"]

    def add(name: str, function: Callable[..., Any], run: Callable[..., Any]) -> None:
        found[name] = function, run

    for name, system in known.items():
        add(
            f"simulate, {name}",
            ss.simulate,
            lambda t, system=system, **limit: ss.simulate(system, t, max_events=MANY, **limit),
        )
    over = {"damping": np.linspace(0.1, 0.2, 8)}
    for name in ("closed form", "one slip"):
        add(
            f"simulate_many, {name}",
            ss.simulate_many,
            lambda t, system=known[name], **limit: ss.simulate_many(
                system, over, t, max_events=MANY, workers=1, **limit
            ),
        )
    for name in ("closed form", "smooth", "one slip"):
        add(
            f"section, {name}",
            ss.section,
            lambda t, system=known[name], **limit: ss.section(
                system, "maximum", t_end=t, transient=0.0, max_events=MANY, **limit
            ),
        )
    for name in ("closed form", "smooth", "integration"):
        add(
            f"orbit_diagram, {name}",
            ss.orbit_diagram,
            lambda t, system=known[name], **limit: ss.orbit_diagram(
                system, "drive_velocity", [0.2, 0.3], periods=int(100 + t), workers=1, **limit
            ),
        )
    add(
        "regime_map",
        ss.regime_map,
        lambda t, **limit: ss.regime_map(
            closed, {"drive_velocity": [0.2, 0.3]}, transient=t, window=4, workers=1, **limit
        ),
    )
    add(
        "basins",
        ss.basins,
        lambda t, **limit: ss.basins(closed, x=[0.0, 0.1], v=[0.0, 0.1], transient=t, window=4, workers=1, **limit),
    )
    for name in ("closed form", "smooth", "one slip"):
        add(
            f"derivatives, {name}",
            EventSequence.of_run,
            lambda t, system=known[name]: EventSequence.of_run(system, t, max_events=10**9),
        )
    for name in ("closed form", "smooth"):
        add(f"lyapunov, {name}", ss.lyapunov, lambda t, system=known[name]: ss.lyapunov(system, t))
    free = ss.Oscillator(0.1, 0.2, ss.laws.ExponentialStribeck(1.0, 0.5, 0.5))
    values = np.linspace(0.15, 0.4, 2000)

    def again(function: Callable[[float], Any]) -> Callable[[float], None]:
        def run(t: float) -> None:
            for value in values if t >= FOREVER else values[:1]:
                function(float(value))

        return run

    for name in ("closed form", "smooth"):
        add(
            f"periodic_orbit, {name}",
            ss.periodic_orbit,
            again(lambda _, system=known[name]: ss.periodic_orbit(system, t_end=1000.0)),
        )
    add(
        "continuation",
        ss.continuation,
        again(lambda value: ss.continuation(free, "drive_velocity", (value, value + 1.0))),
    )
    add("critical_velocities", ss.critical_velocities, again(lambda value: ss.critical_velocities(free, (value, 3.0))))
    cycle = ss.Oscillator(0.05, 0.2, ss.laws.StaticKinetic(1.0, 0.6))
    add("multipliers", ss.periodic_orbit, again(lambda _: ss.periodic_orbit(cycle, t_end=200.0).multipliers))
    orbit = ss.simulate(ss.Oscillator(0.05, 0.2, ss.laws.StaticKinetic(1.0, 0.6)), 5000.0)
    add("sensitivities", sensitivities, again(lambda _: sensitivities(orbit, ["damping"])))
    return found


def after_a_signal(run: Callable[[float], Any], lead: float = LEAD) -> float:
    """Processor time from the signal of Ctrl-C to the exception."""
    begin, sent = time.process_time(), []

    def send() -> None:
        while time.process_time() < begin + lead:
            time.sleep(0.005)
        sent.append(time.process_time())
        os.kill(os.getpid(), signal.SIGINT)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    sender = threading.Thread(target=send)
    sender.start()
    try:
        run(FOREVER)
    except KeyboardInterrupt:
        return time.process_time() - sent[0]
    finally:
        sender.join()
        signal.signal(signal.SIGINT, before)
    raise RuntimeError("the run ended by itself")


def after_the_limit(run: Callable[..., Any]) -> float:
    """Processor time of a run that is limited to a millisecond."""
    begin = time.process_time()
    run(FOREVER, max_seconds=1e-3)
    return time.process_time() - begin


def main() -> None:
    """The table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--repeats", type=int, default=5)
    repeats = range(parser.parse_args().repeats)
    text, largest = HEAD.format(lead=LEAD, repeats=len(repeats)), 0.0
    for name, (function, run) in runs().items():
        run(1e-3 if "orbit" not in name else 10.0)  # everything is imported
        told = [max(after_a_signal(run) for _ in repeats)]
        if "max_seconds" in inspect.signature(function).parameters:
            told.append(max(after_the_limit(run) for _ in repeats))
        largest = max(largest, *told)
        row = f"| {name} | {' | '.join([*(f'{seconds:.3f}' for seconds in told), '-'][:2])} |\n"
        print(row, end="", flush=True)
        text += row
    PAGE.write_text(text, encoding="utf-8")
    if largest > 1:
        raise SystemExit(f"the longest took {largest:.2f} s")


if __name__ == "__main__":
    main()
