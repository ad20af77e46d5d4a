"""``stickslip track``: films or folders of images to motion files."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.cli.terminal import Bar, Commands, save_figure, say, say_json, say_value, say_written
from stickslip.errors import InputError

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

OPTIONS = ("finder", "masses", "marker", "channel", "size", "threshold", "level", "opening", "region", "max_jump")


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    command = commands.add_parser("track", help="turn films or folders of images into motion files")
    command.add_argument("source", nargs="+", metavar="IMAGES_OR_VIDEO", help="a film each; or the images of one film")
    command.add_argument("--setup", metavar="TRACK.toml", help="setup file; the options below override it")
    command.add_argument(
        "--finder", choices=("blob", "template", "fiducial"), help="how markers are found; default blob"
    )
    command.add_argument("--masses", type=int, metavar="N", help="number of markers; default 1")
    command.add_argument("--marker", metavar="COLOUR", help="dark (default), bright, red, green, ... or #rrggbb")
    command.add_argument("--channel", choices=("grey", "red", "green", "blue"), help="what brightness means")
    command.add_argument("--size", type=float, metavar="PX", help="diameter of a marker, to within a factor 2")
    command.add_argument("--threshold", type=float, metavar="GREY", help="least contrast of a marker")
    command.add_argument("--level", type=float, metavar="GREY", help="grey level of a body's outline")
    command.add_argument("--opening", type=int, metavar="PX", help="remove parts of a body that are thinner than this")
    command.add_argument("--region", type=float, nargs=4, metavar=("X", "Y", "W", "H"), help="search only here")
    command.add_argument("--moving", action="store_true", default=None, help="prefer a moving spot")
    command.add_argument("--max-jump", type=float, metavar="PX", help="farthest jump between two pictures")
    command.add_argument("--frame-rate", type=float, metavar="HZ", help="pictures per second of the camera")
    command.add_argument("--times", metavar="FILE", help="text file with one time a line")
    command.add_argument("--scale", type=float, metavar="PX", help="px per m; a setup file has other calibrations")
    command.add_argument(
        "-o", "--output", metavar="MOTION.nc|FOLDER",
        help="the motion file; for many films a folder; x, and so the rest of a rig, counts from the calibration's zero: the "
        "first of two points, position 0 of marks, the picture's upper left corner for a scale, or the origin of the setup",
    )  # fmt: skip
    command.add_argument("--check", metavar="FILM.avi|FOLDER", help="write the film with the tracks drawn in")
    command.add_argument(
        "--plot", metavar="FILE.png", help="draw the tracks over the film; of many films FILE-FILM.png each"
    )
    command.add_argument(
        "--choose", nargs="?", const="", metavar="PAGE.html",
        help="choose markers, scale and region on a page, which gives the setup file; only written where PAGE.html is given",
    )  # fmt: skip
    command.add_argument(
        "--field",
        type=int,
        metavar="PX",
        help="displacement and strain of the texture instead, on a grid of this spacing",
    )
    command.add_argument(
        "--free-fall", action="store_true", help="print the scale that the free fall of the mass gives"
    )
    command.add_argument("--again", action="store_true", help="of many films track also those that are finished")
    command.add_argument("--json", action="store_true", help="print the result as JSON")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Run ``stickslip track``.

    Raises
    ------
    InputError
        where the film cannot be tracked; of many films, where any could not, after all others are done.
    """
    from stickslip.tracking.video.source import IMAGES

    given: dict[str, Any] = {name: getattr(options, name) for name in (*OPTIONS, "frame_rate", "times", "moving")}
    if options.scale is not None:
        given["calibration"] = {"scale": options.scale}
    command = shlex.join(["stickslip", *sys.argv[1:]])
    sources = options.source
    if all(Path(source).suffix.lower() in IMAGES for source in sources):
        sources = [[Path(source) for source in sources]] if len(sources) > 1 else sources
    if options.choose is not None:
        _choose(sources, options)
    elif options.field is not None:
        _field(sources, options, given, command)
    elif len(sources) == 1:
        _track_one(sources[0], options, given, command)
    else:
        _track_many(sources, options, given, command)


def _choose(sources: list[Any], options: argparse.Namespace) -> None:
    from stickslip.cli.explore import cache
    from stickslip.tracking.choose import write_choice

    if len(sources) > 1:
        raise InputError(f"track: --choose looks at one film, got {len(sources)}; give the first, its setup serves all")
    path = write_choice(sources[0], options.choose or cache() / "choose.html", options.frame_rate)
    say_written(path)
    if not options.choose:
        import webbrowser

        webbrowser.open(path.as_uri())


def _field(sources: list[Any], options: argparse.Namespace, given: dict[str, Any], command: str) -> None:
    from stickslip.show.field import field_figure
    from stickslip.tracking.field import displacement_field

    other = [f"--{name.replace('_', '-')}" for name in ("check", "free_fall", "again") if getattr(options, name)]
    if len(sources) > 1 or other:
        got = f"{len(sources)} films" if len(sources) > 1 else ", ".join(other)
        raise InputError(
            f"track: --field is of one film and writes -o and --plot alone, got {got}; leave the others out"
        )
    with Bar() as bar:
        field = displacement_field(
            sources[0],
            options.setup,
            spacing=options.field,
            output=options.output,
            progress=bar,
            command=command,
            **given,
        )
    if options.plot:
        save_figure(field_figure(field), options.plot)
    last = field.isel(time=-1)
    facts = {
        "source": field.attrs["source"],
        "pictures": field.sizes["time"],
        "pieces": field.sizes["x"] * field.sizes["y"],
        "found": int(last["u"].count()),
        **{
            name: {
                "from": float(last[name].min()),
                "to": float(last[name].max()),
                "error": float(last[f"{name}_error"].median()),
            }
            for name in ("u", "v", "exx", "eyy", "exy", "rotation")
        },
        "notes": list(field.attrs["notes"]),
    }
    if options.json:
        say_json(facts)
        return
    for name, value in facts.items():
        for one in value if name == "notes" else [value]:
            said = f"{one['from']:.3g} to {one['to']:.3g}, error {one['error']:.2g}" if isinstance(one, dict) else one
            say_value("note" if name == "notes" else name, said)
    say_written(options.output, options.plot)


def _track_one(source: str | list[Path], options: argparse.Namespace, given: dict[str, Any], command: str) -> None:
    from stickslip.tracking.film_tracking import track

    with Bar() as bar:
        motion = track(
            source, options.setup, output=options.output, check=options.check, progress=bar, command=command, **given
        )
    if options.plot:
        from stickslip.tracking.check_film import tracks_over_film

        save_figure(tracks_over_film(motion, source).figure, options.plot)
    facts = _facts(motion)
    if options.free_fall:
        from stickslip.tracking.scale.scale_check import free_fall

        fall = free_fall(motion)
        facts |= {"free_fall": fall.sentence, "drift": fall.drift, "residual": fall.residual}
    if options.json:
        say_json(facts)
        return
    for name, value in facts.items():
        if name == "notes":
            for note in value:
                say_value("note", note)
        elif name == "masses":
            for row in value:
                say(
                    f"{row['name']:20s}seen in {row['seen']} of {facts['pictures']} pictures, "
                    f"x {row['x_from']:.6g} to {row['x_to']:.6g}, error {row['x_error']:.2g} {facts['units']}"
                )
        else:
            say_value(name, value)
    say_written(options.output, options.check, options.plot)


def _track_many(sources: list[str], options: argparse.Namespace, given: dict[str, Any], command: str) -> None:
    from stickslip.tracking.batch import track_films

    if not options.output:
        raise InputError("track: several films need a folder for their motion files; add -o FOLDER")
    with Bar() as bar:
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
    drawn = _draw_many(table, options.plot) if options.plot else []
    if options.json:
        say(str(table.to_json(orient="records", indent=2)))
    else:
        for row in table.to_dict("records"):
            say(f"{row['state']:18s}{row['source']}" + (f": {row['message']}" if row["message"] else ""))
        say_written(*drawn)
    failed = int((table["state"] == "failed").sum())
    if failed:
        raise InputError(f"{failed} of {len(table)} films could not be tracked; the others are in {options.output}")


def _draw_many(table: pd.DataFrame, plot: str) -> list[str]:
    """The tracks over each film that could be tracked: ``tracks.png`` becomes ``tracks-FILM.png``."""
    import matplotlib.pyplot as plt

    from stickslip.files.netcdf import tree_of
    from stickslip.tracking.check_film import tracks_over_film

    drawn = []
    for row in table[table["state"] != "failed"].to_dict("records"):
        figure = tracks_over_film(tree_of(Path(row["motion"])).to_dataset(), row["source"]).get_figure(root=True)
        drawn.append(str(Path(plot).with_stem(f"{Path(plot).stem}-{Path(row['motion']).stem}")))
        save_figure(figure, drawn[-1])
        plt.close()
    return drawn


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
                "name": str(motion["name"].item(int(mass))) if "name" in motion.coords else f"mass {mass}",
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
