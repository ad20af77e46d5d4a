"""``stickslip film``: a film of a simulated rig, with every position known."""

from __future__ import annotations

import argparse
from pathlib import Path

from stickslip.cli.terminal import Bar, Commands, say, say_json, say_written


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    command = commands.add_parser("film", help="make a film of a simulated rig, with every position known")
    command.add_argument("system", metavar="SYSTEM.toml")
    command.add_argument(
        "-o", "--output", required=True, metavar="FILM.avi|FOLDER", help=".avi, .mkv, .mp4, or a folder for PNG"
    )
    command.add_argument("--start", type=float, metavar="T", help="first time of the film; default half the orbit")
    command.add_argument(
        "--duration", type=float, metavar="T", help="duration of the film; default ten natural periods"
    )
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
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Run ``stickslip film``: the film, beside it the truth (``.truth.nc``) and how to track it (``.track.toml``)."""
    from stickslip.files.disk import write_text
    from stickslip.model.system_file import load_system_document
    from stickslip.simulation.simulate import simulate
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
    with Bar() as bar:
        truth = film(orbit, output, start=start, duration=duration, progress=bar, **camera)
    beside = {"truth": output.with_suffix(".truth.nc"), "setup": output.with_suffix(".track.toml")}
    save_motion(truth, beside["truth"])
    write_text(beside["setup"], truth.attrs["setup"])
    if options.json:
        facts = {
            "film": str(output),
            "pictures": truth.sizes["time"],
            **{key: str(path) for key, path in beside.items()},
        }
        say_json(facts)
        return
    say(f"film                {truth.sizes['time']} pictures, {camera['frame_rate']:.4g} per unit of time")
    say_written(output, *beside.values())
    say(f"track it with       stickslip track {output} --setup {beside['setup']} -o {output.with_suffix('.nc')}")
