"""From a film to the motion of its markers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.files.disk import check_writable
from stickslip.tracking.bodies import rigid_body
from stickslip.tracking.doubts import describe, notes_on_track, unclear
from stickslip.tracking.finding.blobs import ALIKE
from stickslip.tracking.finding.detections import Detections
from stickslip.tracking.finding.fiducial import check_dictionary, find_fiducials
from stickslip.tracking.finding.response_map import response_map
from stickslip.tracking.finding.subset import Subset
from stickslip.tracking.finding.surroundings import KeptPictures
from stickslip.tracking.finding.template import find_templates
from stickslip.tracking.finding.window import WindowedFinder
from stickslip.tracking.linking import Track, find_markers
from stickslip.tracking.motion import motion_dataset, save_motion
from stickslip.tracking.positions.meetings import separate
from stickslip.tracking.positions.shake_and_shutter import without_shake, without_shutter
from stickslip.tracking.positions.size_changes import hidden
from stickslip.tracking.positions.standard_errors import errors_from_scatter, errors_from_surroundings
from stickslip.tracking.scale.calibration import PIXELS, Calibration, read_calibration
from stickslip.tracking.setup import Setup
from stickslip.tracking.video.copies import Changes, copies, note_on_copies
from stickslip.tracking.video.osp import PROJECTS, TEXTS, read_osp
from stickslip.tracking.video.source import Film, Picture
from stickslip.tracking.video.writing import check_target

if TYPE_CHECKING:
    import xarray as xr

Progress = Callable[[str, int, int], object]
Finder = Callable[[Iterator[Picture | None]], Iterator[tuple[Detections, bool]]]
"""Detections of picture after picture, and whether the whole of it was looked at."""

CUT = ": cut off at the edge"
"""Follows the coordinates that an edge takes, in the reason why they are missing."""

STRANGERS = 0.05
"""A track of which so many sightings are of another size than the markers usually have is doubtful."""

CROWD = 60
"""More candidates than this (and three a mass) are not looked at in one picture."""


def track(
    source: str | Path | list[Path],
    setup: Setup | Mapping[str, Any] | str | Path | None = None,
    *,
    output: str | Path | None = None,
    check: str | Path | None = None,
    progress: Progress | None = None,
    command: str | None = None,
    **options: Any,
) -> xr.Dataset:
    """Follow markers through a film.

    Parameters
    ----------
    source : a video file, a folder of images, a list of images, or a project or text export of OSP Tracker.
    setup : what to look for: a :class:`Setup`, a table or the path of a TOML file. Default: one dark spot, in px.
    output : write the motion there (netCDF).
    check : write a film with the tracks drawn in there (``.avi``, ``.mp4``, or a folder of PNG).
    progress : called with (what, pictures done, pictures in all).
    command : what the motion's ``command`` attribute says; default this call.
    options : fields of :class:`Setup`, over those of `setup`: ``marker="bright"``, ``masses=2``, ``size=20``,
        ``region=[x, y, width, height]``, ``frame_rate=240``, ``calibration={"scale": 4000}``, ...

    Returns
    -------
    The motion, a Dataset with the dimensions ``time`` (s) and ``mass``:

    * ``x``, ``y`` and their standard errors ``x_error``, ``y_error`` in m (``attrs["units"]``; px without a calibration);
      with a calibration x runs along its axis and y to its left, in px y runs downwards as in the picture; both count from
      the calibration's zero (:func:`stickslip.tracking.read_calibration`), and so does the `rest` of a rig;
    * ``lost``: empty where the marker was seen, else the reason why it was not; x and y are then NaN. A marker cut off
      at one pair of edges keeps the coordinate along them. Two that touch are one spot, which is neither's position;
    * ``x_px``, ``y_px``: the places in the picture, and the coordinate ``frame``, the picture's number.

    The errors are those of the picture's noise at each point, or the scatter from picture to picture where that is more (as
    by compression); what stays for longer than some pictures is in them as far as a factor of 1.15, and of 1.6 for strongly
    compressed films, holds it. A ground with texture counts as noise where it passes by the marker, and not where it moves
    along with it, which the pixels around it tell. A wrong scale is not in them: ``scale_error`` in the attributes says
    how well that is known.

    Raises
    ------
    InputError
        where the film cannot be read, the setup is wrong, a marker is never seen.

    Examples
    --------
    >>> motion = track("slider.mp4", marker="green", frame_rate=240)  # doctest: +SKIP
    >>> motion.x.sel(mass=0).plot()  # doctest: +SKIP
    """
    path = Path(source) if not isinstance(source, list) else None
    _check_outputs(source, output, check)
    options = {name: value for name, value in options.items() if value is not None}
    if path is not None and path.suffix.lower() in (*PROJECTS, *TEXTS):
        if setup is not None or options:
            raise InputError(f"{path}: an OSP Tracker file holds its own tracks and scale; leave the setup out")
        motion = read_osp(path)
    else:
        motion = _track_film(source, Setup.of(setup, **options), progress)
    motion.attrs["command"] = command or f"stickslip.track({str(source)!r})"
    if check is not None:
        if path is not None and path.suffix.lower() in (*PROJECTS, *TEXTS):
            raise InputError(f"{path}: a check film needs the film itself, not its tracks; track the video")
        from stickslip.tracking.check_film import write_check_film

        write_check_film(motion, source, check, progress)
    if output is not None:
        save_motion(motion, output)
    return motion


def _check_outputs(source: str | Path | list[Path], output: str | Path | None, check: str | Path | None) -> None:
    """Refuse, before the work, what could not be written after it, and what would be written over the film."""
    sources = {Path(one).resolve() for one in (source if isinstance(source, list) else [source])}
    for position in (output, check):
        if position is not None and Path(position).resolve() in sources:
            raise InputError(f"{position}: this is the film itself, which would be lost; choose another name")
    if output is not None:
        check_writable(output)
    if check is not None:
        check_target(check)


@dataclass
class _Seen:
    times: list[float]
    pictures: list[Detections]
    readable: list[bool]
    whole: list[bool]
    shape: tuple[int, int]
    kept: KeptPictures
    corner: tuple[int, int]
    shown: int = 1
    """Times that each picture is shown; only the first of them counts."""
    numbers: npt.NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    """Of the pictures in the film."""


def _track_film(source: str | Path | list[Path], setup: Setup, progress: Progress | None) -> xr.Dataset:
    film = setup.film(source)
    seen, tracks = _followed(film, setup, progress)
    notes = unclear(film.name, setup, seen.pictures, seen.whole, tracks)
    if (size := _doubted_size(setup, seen, tracks, bool(notes))) is not None:
        try:
            seen, tracks = _followed(film, replace(setup, size=size), progress)
            notes = [
                *unclear(film.name, setup, seen.pictures, seen.whole, tracks),
                f"The markers are about {size:.3g} px wide where they were seen first: they were looked for again as such, "
                "as other spots may be taken for them; give size if that is wrong.",
            ]
        except InputError:  # nothing of one size goes through the film
            pass
    notes += [
        f"At ({still.x:.0f}, {still.y:.0f}) px rests a spot that looks like a {describe(setup)} too; mass {mass} is the one "
        "that moves: give start or region if that is wrong."
        for mass, track in enumerate(tracks)
        for still in track.at_rest
    ]
    return _motion(film, setup, seen, tracks, notes)


def _followed(film: Film, setup: Setup, progress: Progress | None) -> tuple[_Seen, list[Track]]:
    """What was seen in the film, and the tracks of the markers.

    Raises
    ------
    InputError
        where one of them cannot be followed.
    """
    seen = _look(film, setup, progress)
    if not any(len(detections) for detections in seen.pictures):
        raise InputError(
            f"{film.name}: no {describe(setup)} was seen in {len(seen.times)} pictures; look at the film and correct "
            "marker, size, threshold or region"
        )
    tracks = find_markers(
        seen.pictures,
        setup.count,
        max_jump=setup.max_jump,
        start=setup.start,
        moving=setup.moving,
        resting=len(setup.reference or ()),
    )
    if setup.finder != "blob":
        tracks.sort(key=lambda track: track.label if setup.ids is None else setup.ids.index(track.label))
    if len(tracks) < setup.count:
        raise InputError(
            f"{film.name}: {setup.count} times a {describe(setup)} is wanted, but only {len(tracks)} can be followed; "
            "correct masses, size, threshold or region"
        )
    return seen, tracks


def _doubted_size(setup: Setup, seen: _Seen, tracks: list[Track], unclear: bool) -> float | None:
    """The usual diameter of markers, where none was given and what was taken for them is `unclear` or changes its size."""
    if setup.finder != "blob" or setup.size is not None or setup.level is not None:
        return None
    sizes = [
        np.array([seen.pictures[frame].size[index] for frame, index in zip(track.frames, track.indices, strict=True)])
        for track in tracks
    ]
    own = np.array([np.median(one) for one in sizes])
    usual = float(np.quantile(own, 0.5, method="lower"))
    if np.mean(np.abs(np.log(own / usual)) < math.log(ALIKE)) <= 0.5:
        return None  # markers of several sizes
    unlike = any(np.mean(np.abs(np.log(one / usual)) > math.log(ALIKE)) > STRANGERS for one in sizes)
    return usual if unlike or unclear else None


def _look(film: Film, setup: Setup, progress: Progress | None) -> _Seen:
    first = next((picture for _, picture in film if picture is not None), None)
    shape = (0, 0) if first is None else (first.shape[0], first.shape[1])
    if first is None:
        return _Seen([], [], [], [], shape, KeptPictures(), (0, 0))
    box = setup.box(first, film.name)
    seen = _Seen([], [], [], [], shape, KeptPictures(), (box[1].start, box[0].start))
    total, changes = len(film), Changes()

    def pictures() -> Iterator[Picture | None]:
        for time, picture in film:
            seen.times.append(time)
            seen.readable.append(picture is not None)
            changes.look(None if picture is None else picture[box])
            if setup.finder == "blob" and picture is not None and seen.kept.due(len(seen.times) - 1):
                seen.kept.keep(len(seen.times) - 1, response_map(picture[box], setup.marker, setup.channel))
            yield None if picture is None else picture[box]
            if progress is not None:
                progress(f"looking at {Path(film.name).name}", len(seen.times), max(total, len(seen.times)))

    for found, whole in _finder(setup, first, film.name)(pictures()):
        seen.pictures.append(found.best(max(CROWD, 3 * setup.count)).moved(box[1].start, box[0].start))
        seen.whole.append(whole)
    seen.shown, copied = copies(changes.values)
    seen.numbers = np.flatnonzero(~copied)
    if seen.shown > 1:
        _leave_out_copies(seen)
    return seen


def _leave_out_copies(seen: _Seen) -> None:
    """Copies are no samples: twice the same place would say that the marker rests, and nothing of the noise."""
    new = seen.numbers
    number = {int(picture): i for i, picture in enumerate(new)}
    seen.times, seen.pictures = [seen.times[i] for i in new], [seen.pictures[i] for i in new]
    seen.readable, seen.whole = [seen.readable[i] for i in new], [seen.whole[i] for i in new]
    seen.kept.pictures = {number[i]: kept for i, kept in seen.kept.pictures.items() if i in number}


def _finder(setup: Setup, first: Picture, name: str) -> Finder:
    """What looks for the markers, in the pictures of the region."""
    if setup.finder == "blob":
        level = setup.level
        if level is not None and setup.marker == "dark":
            level = 255 - level
        return WindowedFinder(
            lambda picture: response_map(picture, setup.marker, setup.channel),
            setup.count,
            size=setup.size,
            threshold=setup.threshold,
            level=level,
            opening=setup.opening,
            black={"dark": 255.0, "bright": 0.0}.get(setup.marker),
            # one that is chosen by its place or its way may be fainter than others
            windows=setup.start is None and not setup.moving,
        )
    if setup.finder == "fiducial":
        check_dictionary(setup.dictionary)
        return _whole(lambda picture: find_fiducials(picture, setup.dictionary, setup.ids))
    pieces: list[Subset] = []
    for x, y, w, h in setup.templates or ():
        if x + w > first.shape[1] or y + h > first.shape[0]:
            raise InputError(
                f"{name}: the template [{x}, {y}, {w}, {h}] leaves the picture of {first.shape[1]} x {first.shape[0]} px"
            )
        pieces.append(Subset(response_map(first[y : y + h, x : x + w], "bright", setup.channel)))
    return _whole(lambda picture: find_templates(response_map(picture, "bright", setup.channel), pieces))


def _whole(find: Callable[[Picture], Detections]) -> Finder:
    """Look at all of every picture."""
    nothing = Detections.of([])
    return lambda pictures: ((nothing if picture is None else find(picture), True) for picture in pictures)


def _motion(film: Film, setup: Setup, seen: _Seen, tracks: list[Track], notes: list[str]) -> xr.Dataset:
    shape = len(seen.times), len(tracks)
    x, y, x_error, y_error, size, size_error, contrast = (np.full(shape, np.nan) for _ in range(7))
    lost = np.full(shape, "", dtype=object)
    times = np.array(seen.times)
    for mass, marker in enumerate(tracks):
        lost[:, mass] = _reasons(marker, seen)
        for frame, position in zip(marker.frames, marker.indices, strict=True):
            found = seen.pictures[frame]
            x[frame, mass], y[frame, mass] = found.x[position], found.y[position]
            x_error[frame, mass], y_error[frame, mass] = found.x_error[position], found.y_error[position]
            size[frame, mass], size_error[frame, mass] = found.size[position], found.size_error[position]
            contrast[frame, mass] = found.contrast[position]
            cut = [name for name, off in (("x", found.cut_x[position]), ("y", found.cut_y[position])) if off]
            lost[frame, mass] = " and ".join(cut) + CUT if cut else ""
        if not np.isin(lost[:, mass], ["", *(axis + CUT for axis in "xy")]).any():
            raise InputError(
                f"{film.name}: what was taken for mass {mass} is seen whole in none of {len(times)} pictures "
                f"({lost[0, mass]}), so it is hardly the {describe(setup)} that is meant; give region, start or moving"
            )
        if setup.finder == "blob":
            _hide(lost[:, mass], x[:, mass], y[:, mass], size[:, mass])
    if setup.finder == "blob":
        notes += separate(x, y, size, contrast, [x_error, y_error, size_error], lost, times)
    for mass in range(shape[1]):
        if setup.finder == "blob":
            notes += errors_from_surroundings(
                *(mass, seen.kept.pictures, seen.corner, x[:, mass], y[:, mass], size[:, mass], size_error[:, mass]),
                film.copied,
                *(x_error[:, mass], y_error[:, mass]),
            )
        notes += notes_on_track(mass, x[:, mass], y[:, mass], size[:, mass])
    if setup.reference:  # before the scatter is judged, which is the camera's until then
        notes.append(without_shake(setup.reference, x, y, x_error, y_error, lost))
    for mass in range(shape[1]):
        if mass not in (setup.reference or ()):
            axes = (x[:, mass], x_error[:, mass]), (y[:, mass], y_error[:, mass])
            notes += errors_from_scatter(mass, times, film.copied, *axes)
    calibration = PIXELS
    if setup.calibration is not None:
        calibration = read_calibration(
            setup.calibration, setup.folder, float(np.nanmedian(size)), beside=Path(film.name), shape=seen.shape
        )
    motion = motion_dataset(
        *(times, x, y, x_error, y_error, lost, calibration),
        source=film.name,
        frame_rate=film.rate / seen.shown,
        diameter=size if setup.finder == "blob" else None,
    )
    if seen.shown > 1:
        motion = motion.assign_coords(frame=("time", seen.numbers))
        notes.insert(0, note_on_copies(seen.shown, float(motion.attrs["frame_rate"])))
    if setup.exposure or setup.line_time:
        notes.append(without_shutter(motion, setup.exposure or 0.0, setup.line_time or 0.0))
    if setup.names is not None:
        motion = motion.assign_coords(name=("mass", list(setup.names)))
    if setup.reference:
        kept = [mass for mass in range(setup.count) if mass not in setup.reference]
        motion, size = motion.isel(mass=kept).assign_coords(mass=np.arange(len(kept))), size[:, kept]
    motion.attrs["notes"] = [*film.notes, *calibration.notes, *_notes_on_gaps(motion, calibration, size), *notes]
    if setup.bodies:
        motion = _bodies(motion, setup)
    motion.attrs["setup"] = setup.to_toml()
    return motion


def _bodies(motion: xr.Dataset, setup: Setup) -> xr.Dataset:
    """The motion of the bodies of the setup, for that of their points."""
    import xarray as xr

    numbers = [mass for mass in range(setup.count) if mass not in (setup.reference or ())]
    found = [rigid_body(motion, [numbers.index(point) for point in body]) for body in setup.bodies or ()]
    joined = xr.concat(found, "mass", combine_attrs="override").assign_coords(mass=np.arange(len(found)))
    joined.attrs["notes"] = [*motion.attrs["notes"], *(one.attrs["notes"][-1] for one in found)]
    return joined


def _hide(lost: np.ndarray, x: Array, y: Array, size: Array) -> None:
    """Take out where something hides a part of the marker, so that its centre is not its own."""
    partly = hidden(np.where(lost == "", size, np.nan))
    lost[partly] = "partly hidden"
    x[partly] = y[partly] = np.nan


def _reasons(marker: Track, seen: _Seen) -> list[str]:
    """Why the marker is missing where it is, one a picture."""
    height, width = seen.shape
    first, last = marker.frames[0], marker.frames[-1]
    margin = marker.size + float(np.hypot(marker.vx, marker.vy))
    near_edge = min(marker.x, marker.y, width - 1 - marker.x, height - 1 - marker.y) < margin
    reasons = []
    for frame in range(len(seen.times)):
        if not seen.readable[frame]:
            reasons.append("picture cannot be read")
        elif frame < first:
            reasons.append("not yet seen")
        elif frame > last:
            reasons.append("left the picture" if near_edge else "no longer seen")
        else:
            reasons.append("not found")
    return reasons


def _leaning(motion: xr.Dataset, reason: str, calibration: Calibration, size: Array) -> str:
    """How far half a marker across the cut moves the coordinate along it, where that is more than noise."""
    if calibration.unit == "px" or reason not in ("x" + CUT, "y" + CUT):
        return ""
    rows = motion["lost"].to_numpy() == reason
    x, y, half = motion["x_px"].to_numpy()[rows], motion["y_px"].to_numpy()[rows], 0.5 * size[rows]
    along, other = ("y", 1) if reason.startswith("x") else ("x", 0)
    aside = calibration.to_world(x + half * other, y + half * (1 - other))[other]
    off = float(np.abs(aside - calibration.to_world(x, y)[other]).max())
    noise = float(np.nanmedian(motion[f"{along}_error"].to_numpy()))
    return f"{along} is known to ± {off:.2g} {calibration.unit} only" if off > 2 * noise else ""


def _notes_on_gaps(motion: xr.Dataset, calibration: Calibration, size: Array) -> list[str]:
    """Sentences on missing pictures and uneven times."""
    notes = []
    for mass in range(motion.sizes["mass"]):
        reasons = motion["lost"].to_numpy()[:, mass]
        counts = {str(reason): int((reasons == reason).sum()) for reason in dict.fromkeys(reasons) if reason}
        cut = {reason: counts.pop(reason) for reason in [*counts] if reason.endswith(CUT)}
        for reason, count in cut.items():
            given = f"Mass {mass} has no {reason.removesuffix(CUT)} in {count} of {len(reasons)} pictures{CUT}"
            off = _leaning(motion.isel(mass=mass), reason, calibration, size[:, mass])
            notes.append(given + (f"; the axis leans, so {off}." if off else "."))
        if counts:
            given = ", ".join(f"{count} {reason}" for reason, count in counts.items())
            notes.append(f"Mass {mass} is missing in {sum(counts.values())} of {len(reasons)} pictures ({given}).")
    steps = np.diff(motion["time"].to_numpy())
    if steps.size and np.ptp(steps) > 0.02 * np.median(steps):
        notes.append(
            f"The pictures are not evenly spaced: {1e3 * steps.min():.4g} to {1e3 * steps.max():.4g} ms apart."
        )
    return notes
