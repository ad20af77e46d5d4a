"""The commands ``stickslip track`` and ``stickslip film``."""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

OPTIONS = ("finder", "masses", "marker", "channel", "size", "threshold", "level", "opening", "region", "max_jump")


def add_track(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``track`` to the sub-commands of the command line."""
    command = commands.add_parser("track", help="turn films or folders of images into motion files")
    command.add_argument("source", nargs="+", metavar="IMAGES_OR_VIDEO", help="a film each; or the images of one film")
    command.add_argument("--setup", metavar="TRACK.toml", help="what to look for; the options below win over it")
    command.add_argument("--finder", choices=("blob", "template", "fiducial"), help="how to look; default blob")
    command.add_argument("--masses", type=int, metavar="N", help="how many markers; default 1")
    command.add_argument("--marker", metavar="COLOUR", help="dark (default), bright, red, green, ... or #rrggbb")
    command.add_argument("--channel", choices=("grey", "red", "green", "blue"), help="what brightness means")
    command.add_argument("--size", type=float, metavar="PX", help="diameter of a marker, to within a factor 2")
    command.add_argument("--threshold", type=float, metavar="GREY", help="least contrast of a marker")
    command.add_argument("--level", type=float, metavar="GREY", help="grey level of a body's outline")
    command.add_argument("--opening", type=int, metavar="PX", help="take off what is thinner than this")
    command.add_argument("--region", type=float, nargs=4, metavar=("X", "Y", "W", "H"), help="look only here")
    command.add_argument("--moving", action="store_true", default=None, help="prefer what moves to what rests")
    command.add_argument("--max-jump", type=float, metavar="PX", help="farthest jump between two pictures")
    command.add_argument("--frame-rate", type=float, metavar="HZ", help="pictures per second of the camera")
    command.add_argument("--times", metavar="FILE", help="text file with one time a line")
    command.add_argument("--scale", type=float, metavar="PX", help="px per m; a setup file knows other calibrations")
    command.add_argument("-o", "--output", metavar="MOTION.nc", help="the motion file; for many films a folder")
    command.add_argument("--check", metavar="FILM.avi", help="write the film with the tracks drawn in")
    command.add_argument("--plot", metavar="FILE.png", help="draw the tracks over the film")
    command.add_argument("--again", action="store_true", help="of many films track also those that are finished")
    command.add_argument("--json", action="store_true", help="print the result as JSON")
    command.set_defaults(run=run_track)


def add_film(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``film`` to the sub-commands of the command line."""
    command = commands.add_parser("film", help="make a film of a simulated rig, with every place known")
    command.add_argument("system", metavar="SYSTEM.toml")
    command.add_argument(
        "-o", "--output", required=True, metavar="FILM.avi", help=".avi, .mkv, .mp4, or a folder for PNG"
    )
    command.add_argument("--start", type=float, metavar="T", help="first time of the film; default half the orbit")
    command.add_argument("--duration", type=float, metavar="T", help="how long it is; default ten natural periods")
    for name, what in (
        ("frame_rate", "pictures per unit of time"),
        ("scale", "px per unit of length"),
        ("marker", "diameter of the markers in px"),
        ("noise", "noise, as px of an edge; default 0.1"),
        ("blur", "lens blur in px"),
        ("k1", "radial lens distortion"),
        ("light", "unevenness of the light, 0 to 0.8"),
        ("exposure", "share of the time the shutter is open"),
    ):
        command.add_argument(f"--{name.replace('_', '-')}", type=float, metavar="X", help=what)
    command.add_argument("--size", type=int, nargs=2, metavar=("W", "H"), help="of the pictures in px")
    command.add_argument("--seed", type=int, help="of noise and texture")
    command.add_argument("--json", action="store_true", help="print the result as JSON")
    command.set_defaults(run=run_film)


def run_track(options: argparse.Namespace) -> int | None:
    """Run ``stickslip track``.

    Raises
    ------
    InputError
        where the film cannot be tracked; of many films, where any could not, after all others are done.
    """
    from stickslip.tracking.source import IMAGES

    given: dict[str, Any] = {name: getattr(options, name) for name in (*OPTIONS, "frame_rate", "times", "moving")}
    if options.scale is not None:
        given["calibration"] = {"scale": options.scale}
    command = shlex.join(["stickslip", *sys.argv[1:]])
    sources = options.source
    if all(Path(source).suffix.lower() in IMAGES for source in sources):
        sources = [[Path(source) for source in sources]] if len(sources) > 1 else sources
    if len(sources) == 1:
        _track_one(sources[0], options, given, command)
    else:
        _track_many(sources, options, given, command)
    return None


def _track_one(source: str | list[Path], options: argparse.Namespace, given: dict[str, Any], command: str) -> None:
    from stickslip.tracking.follow import track

    with _Bar() as bar:
        motion = track(
            source, options.setup, output=options.output, check=options.check, progress=bar, command=command, **given
        )
    if options.plot:
        from stickslip.documents import write_whole
        from stickslip.tracking.check_film import tracks_over_film

        figure: Any = tracks_over_film(motion, source).figure
        kind = Path(options.plot).suffix.lstrip(".") or "png"
        write_whole(options.plot, lambda draft: figure.savefig(draft, format=kind, dpi=150))
    facts = _facts(motion)
    if options.json:
        json.dump(facts, sys.stdout, indent=2, default=float)
        _say("")
        return
    for name, value in facts.items():
        if name == "notes":
            for note in value:
                _say(f"note                {note}")
        elif name == "masses":
            for row in value:
                _say(
                    f"mass {row['mass']:<15d}seen in {row['seen']} of {facts['pictures']} pictures, "
                    f"x {row['x_from']:.6g} to {row['x_to']:.6g}, error {row['x_error']:.2g} {facts['units']}"
                )
        else:
            _say(f"{name.replace('_', ' '):20s}{value:.6g}" if isinstance(value, float) else f"{name:20s}{value}")
    for path in (options.output, options.check, options.plot):
        if path:
            _say(f"written             {path}")


def _track_many(sources: list[str], options: argparse.Namespace, given: dict[str, Any], command: str) -> None:
    from stickslip.tracking.batch import track_films

    if not options.output:
        raise InputError("track: several films need a folder for their motion files; add -o FOLDER")
    with _Bar() as bar:
        table = track_films(
            list(sources),
            options.output,
            options.setup,
            check=bool(options.check),
            again=options.again,
            progress=bar,
            command=command,
            **given,
        )
    if options.json:
        _say(str(table.to_json(orient="records", indent=2)))
    else:
        for row in table.to_dict("records"):
            _say(f"{row['state']:18s}{row['source']}" + (f": {row['message']}" if row["message"] else ""))
    failed = int((table["state"] == "failed").sum())
    if failed:
        raise InputError(f"{failed} of {len(table)} films could not be tracked; the others are in {options.output}")


def _facts(motion: xr.Dataset) -> dict[str, Any]:
    import numpy as np

    rows = []
    for mass in motion["mass"].to_numpy():
        x = motion["x"].sel(mass=mass).to_numpy()
        seen = np.isfinite(x)
        known = x[seen] if seen.any() else np.array([np.nan])
        error = motion["x_error"].sel(mass=mass).to_numpy()[seen]
        rows.append(
            {
                "mass": int(mass),
                "seen": int(seen.sum()),
                "x_from": float(known.min()),
                "x_to": float(known.max()),
                "x_error": float(np.median(error)) if error.size else np.nan,
            }
        )
    return {
        "source": motion.attrs["source"],
        "pictures": motion.sizes["time"],
        "frame_rate": float(motion.attrs["frame_rate"]),
        "units": motion["x"].attrs["units"],
        "masses": rows,
        "notes": list(motion.attrs["notes"]),
    }


def run_film(options: argparse.Namespace) -> None:
    """Run ``stickslip film``: the film, beside it the truth (``.truth.nc``) and how to track it (``.track.toml``)."""
    from stickslip.documents import write_whole
    from stickslip.simulation import simulate
    from stickslip.system import load_system_document
    from stickslip.tracking.motion import save_motion
    from stickslip.tracking.synthetic import film

    system, settings = load_system_document(options.system)
    period = system.natural_period
    duration = 10 * period if options.duration is None else options.duration
    start = 20 * period if options.start is None else options.start
    settings["t_end"] = max(settings.get("t_end", 0.0), start + duration)
    orbit = simulate(system, **settings)
    names = ("frame_rate", "scale", "marker", "noise", "blur", "k1", "light", "exposure", "seed")
    camera = {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    camera.setdefault("frame_rate", 100 / period)
    if options.size:
        camera |= {"width": options.size[0], "height": options.size[1]}
    output = Path(options.output)
    with _Bar() as bar:
        truth = film(orbit, output, start=start, duration=duration, progress=bar, **camera)
    beside = {"truth": output.with_suffix(".truth.nc"), "setup": output.with_suffix(".track.toml")}
    save_motion(truth, beside["truth"])
    write_whole(beside["setup"], lambda draft: draft.write_text(truth.attrs["setup"], encoding="utf-8"))
    if options.json:
        facts = {
            "film": str(output),
            "pictures": truth.sizes["time"],
            **{key: str(path) for key, path in beside.items()},
        }
        json.dump(facts, sys.stdout, indent=2)
        _say("")
        return
    _say(f"film                {truth.sizes['time']} pictures, {camera['frame_rate']:.4g} per unit of time")
    for path in (output, *beside.values()):
        _say(f"written             {path}")
    _say(f"track it with       stickslip track {output} --setup {beside['setup']} -o {output.with_suffix('.nc')}")


def _say(line: str) -> None:
    """Results go to stdout."""
    sys.stdout.write(line + "\n")


class _Bar:
    """Progress on stderr, shown only to a person."""

    def __enter__(self) -> _Bar:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

        columns = (BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}"))
        console = Console(stderr=True)
        self._progress = Progress(*columns, console=console, disable=not console.is_terminal, transient=True)
        self._progress.start()
        self._task = self._progress.add_task("start", total=None)
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def __call__(self, what: str, done: int, total: int) -> None:
        self._progress.update(self._task, description=what, completed=done, total=total)
