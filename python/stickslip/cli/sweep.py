"""``stickslip sweep``: what the steady motion does over one parameter (an orbit diagram) or several (a regime map)."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from stickslip.cli.terminal import Bar, Commands, save_figure, say, say_json, say_value, say_written
from stickslip.errors import InputError
from stickslip.simulation.quantities import QUANTITIES

if TYPE_CHECKING:
    import xarray as xr


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    command = commands.add_parser("sweep", help="orbit diagram over one parameter, regime map over two")
    command.add_argument("system", metavar="SYSTEM.toml")
    command.add_argument(
        "--over",
        action="append",
        required=True,
        metavar="NAME=LO:HI:N",
        help="a number of the system file, such as forcing.amplitude, and its values; also NAME=A,B,C. Twice: a map",
    )
    command.add_argument(
        "--direction",
        action="append",
        choices=("up", "down", "fresh"),
        help="of a diagram: each value from where its neighbour ended, or from a fresh start (default); repeat for several",
    )
    command.add_argument(
        "--quantity",
        choices=tuple(QUANTITIES),
        help="what --plot draws of a diagram: turning points of x (default) or of the slip velocity, x in the section, or "
        "the amplitude of x",
    )
    add_run(command, "DIAGRAM.zarr", transient="300 (diagram: 130)", window="32 (diagram: 20)")
    command.set_defaults(run=run)


def add_run(command: argparse.ArgumentParser, output: str, *, transient: str = "300", window: str = "32") -> None:
    """Declare the options of everything that runs many motions; its defaults in words."""
    command.add_argument(
        "--decide",
        type=int,
        default=0,
        metavar="P",
        help="follow what does not repeat for so many periods, 500 or more",
    )
    command.add_argument("--transient", type=float, metavar="P", help=f"periods that are left out; default {transient}")
    command.add_argument("--window", type=float, metavar="P", help=f"periods that are looked at; default {window}")
    command.add_argument(
        "-o", "--output", metavar=output, help="write a Zarr store, part by part; a killed run goes on from it"
    )
    command.add_argument("--workers", type=int, metavar="N", help="threads; default all cores")
    command.add_argument("--max-seconds", type=float, metavar="S", help="end the runs that are not done after so long")
    command.add_argument("--cluster", metavar="ADDRESS", help="a Dask scheduler whose workers compute instead")
    command.add_argument("--plot", metavar="FILE.png", help="draw the result")
    command.add_argument("--json", action="store_true", help="print the result as JSON")


def axis(text: str, option: str) -> tuple[str, Any]:
    """The name and values of ``NAME=LO:HI:N`` or ``NAME=A,B,C``.

    >>> axis("damping=0.1:0.3:3", "--over")
    ('damping', array([0.1, 0.2, 0.3]))
    """
    name, equals, values = text.partition("=")
    if not equals:
        raise InputError(f"{option}: expected NAME=LO:HI:N or NAME=A,B,C, such as damping=0.1:0.3:100, got {text!r}")
    return name, numbers_of(values, option, text, "NAME=")


def numbers_of(values: str, option: str, text: str, before: str = "") -> Any:
    """The numbers of ``LO:HI:N`` or ``A,B,C``, behind `before` in what the option is given.

    >>> numbers_of("-1:1:3", "--x", "-1:1:3")
    array([-1.,  0.,  1.])
    """
    import numpy as np

    parts = values.split(":")
    try:
        if len(parts) == 1:
            return np.array([float(item) for item in values.split(",")])
        low, high, count = float(parts[0]), float(parts[1]), int(parts[2])
        if len(parts) > 3 or count < 1:
            raise ValueError
    except (ValueError, IndexError):
        example = "damping=0.1:0.3:100" if before else "-1:1:60"
        raise InputError(
            f"{option}: expected {before}LO:HI:N or {before}A,B,C, such as {example}, got {text!r}"
        ) from None
    return np.linspace(low, high, count)


def settings(options: argparse.Namespace, progress: Any) -> dict[str, Any]:
    """The options that all of these commands hand on."""
    names = ("workers", "cluster", "max_seconds")
    return {"store": options.output, "progress": progress, **{name: getattr(options, name) for name in names}}


def run(options: argparse.Namespace) -> None:
    from stickslip.dynamics import orbit_diagram, regime_map
    from stickslip.dynamics.diagrams import windows
    from stickslip.dynamics.regime_maps import shares
    from stickslip.model.system_file import load_system_document

    system, simulation = load_system_document(options.system)
    start = {name: simulation[name] for name in ("x0", "v0") if name in simulation}
    over = dict(axis(text, "--over") for text in options.over)
    if len(over) < len(options.over):
        raise InputError("--over: each parameter can be named once")
    if options.quantity and (len(over) > 1 or not options.plot):
        raise InputError("--quantity: only the picture (--plot) of a diagram over one parameter has one; leave it out")
    if options.direction and len(over) > 1:
        raise InputError("--direction: only a diagram over one parameter has directions; leave it out")
    with Bar() as bar:
        common = settings(options, lambda done, n: bar("runs", done, n)) | start | {"decide": options.decide}
        if len(over) == 1:
            (parameter, values), directions = next(iter(over.items())), options.direction or ["fresh"]
            window = int(options.window or 20)
            result = orbit_diagram(
                system,
                parameter,
                values,
                direction=directions[0] if len(directions) == 1 else directions,
                periods=int(130 if options.transient is None else options.transient) + window,
                keep=window,
                **common,
            )
        else:
            result = regime_map(system, over, **common, **lengths(options))
    if options.plot:
        _plot(result, options.plot, options.quantity or "x")
    runs, regimes, returns = result["regime"].size, shares(result, "regime"), shares(result, "recurrence")
    found = windows(result)
    if options.json:
        say_json(
            {
                "runs": runs,
                "regimes": regimes,
                "recurrence": returns,
                "windows": found,
                "events": int(result["events"].sum()),
            }
        )
        return
    say_value("runs", runs)
    for word, share in (regimes | returns if options.decide else regimes).items():
        say(f"{word.replace('_', ' '):20s}{100 * share:.4g} %")
    for item in found if options.decide else ():
        motion = f"period {item['period']}" if item["period"] else str(item["recurrence"]).replace("_", " ")
        ends = f"{item['from']:.6g} … {item['to']:.6g}"
        say(f"{item['direction']:6s}{ends:24s}{motion}")
    unknown = round(runs * returns.get("undecided", 0.0))
    if unknown:
        say(f"undecided: {unknown} of {runs} motions did not repeat and may still change; {_advice(options.decide)}")
    say_written(options.output, options.plot)


def lengths(options: argparse.Namespace) -> dict[str, Any]:
    """The transient and the window, where they were asked for."""
    return {name: getattr(options, name) for name in ("transient", "window") if getattr(options, name) is not None}


def _advice(decide: int) -> str:
    return "raise --transient or --decide" if decide else "raise --transient, or follow them on with --decide 500"


def _plot(result: xr.Dataset, path: str, quantity: str) -> None:
    from stickslip import show

    if "parameter" in result.attrs:
        ax = show.orbit_diagram_plot(result, quantity=quantity)
    elif result["regime"].ndim == 2:
        ax = show.regime_map_plot(result)
    else:
        raise InputError("--plot: a map over more than two parameters has no picture; leave it out")
    save_figure(ax.figure, path)
