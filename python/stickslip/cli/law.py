"""``stickslip law``: what a law file holds, as numbers, picture, table and code."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from stickslip.cli.terminal import Commands, save_figure, say, say_written
from stickslip.errors import InputError
from stickslip.files.disk import write_text
from stickslip.files.units import rounded, unit_suffix

OF_A_FORCE = {"N": {"velocity": "m/s", "time": "s"}, "N m": {"velocity": "rad/s", "time": "s"}}
"""Units beside one of force, in files that hold no other."""
ENDINGS = {".c": "c", ".py": "python"}
"""Languages of `--code`."""


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    command = commands.add_parser("law", help="show a law file: its numbers, a picture, a table with bands, code")
    command.add_argument("law", metavar="LAW.toml", help="law file, written by identify -o or Law.save")
    command.add_argument(
        "--speed",
        type=float,
        metavar="W",
        help="the largest slip velocity of picture, table and code; of the picture the largest measured one by default",
    )
    command.add_argument("--plot", metavar="FILE.png", help="draw friction over slip velocity, with its 95 %% band")
    command.add_argument(
        "--table", metavar="FILE.csv", help="write friction over slip velocity and stick time, with 95 %% bands"
    )
    command.add_argument(
        "--code", metavar="FILE", help="write the law as a function for a simulator: FILE.c, or FILE.py for Python"
    )
    command.add_argument(
        "--stick-time",
        type=float,
        metavar="T",
        help="stick time that sets the static friction in --code, where it grows",
    )
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    from stickslip.laws import law_code
    from stickslip.laws.bands import table_up_to
    from stickslip.laws.law import law_document, law_of
    from stickslip.laws.numbers import numbers, value

    if (options.table or options.code) and options.speed is None:
        raise InputError("law: --table and --code need the largest slip velocity; give it with --speed")
    if options.stick_time is not None and not options.code:
        raise InputError("law: --stick-time goes with --code; leave it out")
    ending = Path(options.code or "law.c").suffix
    if ending not in ENDINGS:
        raise InputError(f"law: --code: the file must end in {' or '.join(ENDINGS)}, got {options.code}")
    document = law_document(options.law)
    law = law_of(document, options.law)
    units, errors, source = (document.get(name, {}) for name in ("units", "uncertainty", "source"))

    def of(dimension: str) -> str | None:
        """The unit that the numbers of this dimension have in the file, or had in its records."""
        own = next((units.get(name) for name, number in numbers(law).items() if number.dimension == dimension), None)
        recorded = source.get("units") if isinstance(source, dict) else None
        known = recorded if isinstance(recorded, dict) else {}
        beside = {} if dimension == "force" else OF_A_FORCE.get(of("force") or "", {})
        return own or known.get({"velocity": "slip_velocity"}.get(dimension, dimension)) or beside.get(dimension)

    say(type(law).__name__)
    for name in numbers(law):
        number, error = value(law, name), errors.get(name)
        stated = f"{number:.6g}" if error is None else rounded(number, error)
        say(f"  {name:24s}{stated}{unit_suffix(units.get(name))}")
    speeds, rests = (_measured(source, name) for name in ("slip_velocity", "stick_time"))
    fastest = speeds[1] if speeds else None
    if fastest is not None:
        after = f" and rests of {rests[0]:.3g} to {rests[1]:.3g}{unit_suffix(of('time'))}" if rests else ""
        say(f"  fitted to slip velocities up to {fastest:.3g}{unit_suffix(of('velocity'))}{after}")
    beside = source.get("beside_friction", {}) if isinstance(source, dict) else {}
    for name, size in beside.items():
        say(f"  beside friction: {name} = {size}")
    for note in source.get("notes", []):
        say(f"- {note}")
    if options.plot:
        from stickslip.show.canvas import in_units
        from stickslip.show.law import law_plot

        scales = "SI" if of("time") == "s" else "dimensionless"
        axes = law_plot(law, w_max=options.speed or fastest, rests=rests, units=scales)
        axes.set(xlabel="slip velocity w" + in_units(of("velocity")), ylabel="friction force f" + in_units(of("force")))
        save_figure(axes.figure, options.plot)
    if options.table:
        table = table_up_to(law, options.speed, of("force"), of("velocity"), of("time"))
        write_text(options.table, table.to_csv(index=False), ".csv")
    if options.code:
        text = law_code(law, ENDINGS[ending], options.speed, stick_time=options.stick_time, beside=beside)
        write_text(options.code, text, ending)
    say_written(options.plot, options.table, options.code)


def _measured(source: Any, name: str) -> tuple[float, float] | None:
    """Least and greatest value that the records held, None where the file, which anybody may edit, has no such pair."""
    measured = source.get("measured") if isinstance(source, dict) else None
    found = measured.get(name) if isinstance(measured, dict) else None
    if not (isinstance(found, list) and len(found) == 2 and all(isinstance(end, int | float) for end in found)):
        return None
    low, high = map(float, found)
    return (low, high) if 0 <= low <= high > 0 else None
