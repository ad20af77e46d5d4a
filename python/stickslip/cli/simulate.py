"""``stickslip simulate``: simulate the oscillator of a system file."""

from __future__ import annotations

import argparse
from typing import Any

from stickslip.cli.terminal import Commands, save_figure, say_json, say_value, say_written


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    command = commands.add_parser("simulate", help="simulate the oscillator of a system file")
    command.add_argument("system", metavar="SYSTEM.toml")
    command.add_argument("--t-end", type=float, metavar="T", help="time to run; default: 50 natural periods")
    command.add_argument("--x0", type=float, help="position at t = 0; default 0")
    command.add_argument("--v0", type=float, help="velocity at t = 0; default that of the drive")
    command.add_argument("--max-events", type=int, metavar="N", help="largest number of events")
    command.add_argument("--max-seconds", type=float, metavar="S", help="stop after so many seconds")
    command.add_argument("-o", "--output", metavar="ORBIT.nc", help="write the orbit")
    command.add_argument("--plot", metavar="FILE.png", help="draw the orbit")
    command.add_argument("--json", action="store_true", help="print the result as JSON")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    from stickslip.model.system_file import load_system_document
    from stickslip.simulation.simulate import simulate

    system, settings = load_system_document(options.system)
    asked = {name: getattr(options, name) for name in ("t_end", "x0", "v0", "max_events", "max_seconds")}
    settings |= {name: value for name, value in asked.items() if value is not None}
    settings.setdefault("t_end", 50 * system.natural_period)
    orbit = simulate(system, **settings)
    if options.output:
        orbit.save(options.output)
    if options.plot:
        _plot_orbit(orbit, options.plot)
    kinds = orbit.events["kind"].value_counts(sort=False)
    # Of the second half, as the regime: what comes before is a transient.
    late = orbit.events[(orbit.events["contact"] == 0) & (orbit.events["t"] >= 0.5 * orbit.t_end)]
    sticks = late["stick_time"].dropna()
    between = late.loc[late["kind"] == "release", "t"].diff().dropna()
    summary: dict[str, Any] = {
        "regime": orbit.regime(),
        "t_end": orbit.t_end,
        "stop": orbit.stop,
        "events": {str(kind): int(count) for kind, count in kinds.items() if count},
        "mean_stick_time": float(sticks.mean()) if len(sticks) else None,
        "release_interval": float(between.mean()) if len(between) else None,
        "evaluations": orbit.work.evaluations,
    }
    if options.json:
        say_json(summary)
        return
    events = ", ".join(f"{count} {kind}" for kind, count in summary["events"].items()) or "none"
    say_value("regime", summary["regime"])
    say_value("simulated_to", f"t = {orbit.t_end:g}; {orbit.stop_sentence}")
    say_value("events", events)
    for name in ("mean_stick_time", "release_interval"):
        if summary[name] is not None:
            say_value(name, f"{summary[name]:.6g} (second half)")
    say_written(options.output, options.plot)


def _plot_orbit(orbit: Any, path: str) -> None:
    import matplotlib.pyplot as plt

    from stickslip import show

    with show.styled():
        figure = plt.figure(figsize=(9, 4), layout="constrained")
        left, right = figure.subfigures(1, 2, squeeze=False, width_ratios=[1, 1.4])[0]
        show.phase_plane(orbit, left.subplots())
        show.time_series(orbit, right.subplots(3, 1, sharex=True), start=0.5 * orbit.t_end)
    save_figure(figure, path)
