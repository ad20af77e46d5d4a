"""The arrow from friction records to a law with its uncertainty; which law, and of how many pieces, where none is given."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import xarray as xr

from stickslip.errors import InputError
from stickslip.identification.estimator.result import Result
from stickslip.identification.estimator.threads import one_thread
from stickslip.identification.fit_options import Options
from stickslip.identification.guesses.guess_data import BreakAways
from stickslip.identification.kinetic.single_velocity_step import fit_velocity_step
from stickslip.identification.kinetic.velocity_step_fits import LEAST_STEPS, fit_velocity_steps
from stickslip.identification.law_fit import fit_law
from stickslip.identification.records import FrictionRecord, items_of, loaded, read_records
from stickslip.identification.result import Identification
from stickslip.identification.selection.piece_count import choose_pieces
from stickslip.identification.static.caveats import OF_STICK_TIME, notes_on_unlike_records, why_no_growth
from stickslip.identification.static.forms import ONSET, OWN_LEVEL
from stickslip.identification.static.rows import one_rate
from stickslip.identification.static.static_fit import fit_static_friction
from stickslip.identification.steady.form_choice import fit_steady
from stickslip.laws import (
    Combined,
    Coulomb,
    DwellTime,
    ForceRate,
    Law,
    LogarithmicDwell,
    PiecewiseLinear,
    RateState,
    StaticKinetic,
)

BY_FORM: dict[str, type[Law]] = {
    "constant": StaticKinetic,
    "logarithmic": LogarithmicDwell,
    **{form: Combined for form in OF_STICK_TIME if form == ONSET or form.endswith(OWN_LEVEL)},
    "force rate": ForceRate,
    "stick time and force rate": ForceRate,
    "exponential over force rate": ForceRate,
}
"""The law that is taken where none is asked for, by the form of static friction; `DwellTime` for all others."""
CURVES: dict[type[Law], tuple[str, str]] = {
    DwellTime: ("Combined:DwellTime:PiecewiseLinear", "Combined"),
    LogarithmicDwell: ("Combined:LogarithmicDwell:PiecewiseLinear", "Combined"),
    StaticKinetic: ("PiecewiseLinear", "Combined:StaticKinetic"),
}
"""Laws whose kinetic friction is one number, and what has a line or a curve in its place."""
SPEED_RANGES = 8
"""Ranges of slip speed, of as many samples each, in which friction is looked at before a curve is fitted."""
CURVED = 1.2
"""Kinetic friction is no one number where a curve leaves the forces so many times closer."""


FitPath = Literal["motion", "curve", "step", "steps", "static"]


def _of_one(fit: Callable[[Any], Result]) -> Callable[[Any], Result]:
    """A fit of one record that takes a list of one too."""
    return lambda friction: fit(items_of(friction)[0])


FITS: dict[str, tuple[str, Callable[[Any], Result]]] = {
    "curve": (
        "the fit of friction over slip velocity alone (--steady, the way of records without sticks)",
        fit_steady,
    ),
    "step": (
        "the fit of rate-and-state friction to one step of the speed",
        _of_one(fit_velocity_step),
    ),
    "steps": (
        "the fit of rate-and-state friction to steps of the speed",
        _of_one(fit_velocity_steps),
    ),
    "static": ("the fit of static friction to tables of break-aways", fit_static_friction),
}
"""What is fitted to records that hold no motion to fit a law to, in words, and the function that does it."""


def fit_of(friction: Any, law: str | type[Law] | Law | None = None, *, steady: bool = False) -> FitPath:
    """What friction records can tell, if this law is asked for: a motion with its memory, or only tables of friction.

    Parameters
    ----------
    friction : as for :func:`identify`.
    law : that is asked for.
    steady : whether only friction over slip velocity is asked for.
    """
    trees = [loaded(item) for item in items_of(friction)]
    if not trees or not all(isinstance(tree, xr.DataTree) for tree in trees):
        return "motion"
    steps = trees[0]["step"].sizes["step"] if len(trees) == 1 and "step" in trees[0].children else 0
    if _name(law) == RateState.__name__ and steps:
        return "steps" if steps >= LEAST_STEPS else "step"
    if steady or all("time" not in tree.coords and "steady" in tree.children for tree in trees):
        return "curve"
    if law is not None:
        return "motion"
    if all("steady" in tree.children and (steps or not tree["break_away"].sizes["event"]) for tree in trees):
        # Motion without sticks: friction over slip velocity is all there is, or how it settles after one step of the speed.
        return "step" if steps == 1 else "curve"
    return "static" if all("slip_velocity" not in tree.variables for tree in trees) else "motion"


@one_thread
def identify(
    friction: Any,
    law: str | type[Law] | Law | None = None,
    free: Iterable[str] | None = None,
    fixed: Mapping[str, float] | None = None,
    pieces: int | Literal["auto"] | None = None,
    offset: bool = False,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    ties: Mapping[str, str] | None = None,
) -> Any:
    """Identify a friction law, with its uncertainty, from one or more friction records.

    Minimised is the robust misfit between the measured kinetic force and the law replayed with its memory along the
    measured motion, and between the measured break-away forces and f_s(t_s, δ), over all records at once.

    Parameters
    ----------
    friction : a DataTree from :func:`stickslip.measure`, the path of a friction file, or a list of either.
    law : name or class of a law (the first guess then comes from the data), or a law as first guess; default the law whose
        static friction has the form that the break-aways show, `StaticKinetic` where they cannot tell; `notes` says which.
        The parts of `Combined` may be named too: ``"Combined:LogarithmicDwell"``, ``"Combined:DwellTime:Lorentzian"``.
    free : names of the numbers to fit, such as ``"kinetic"``, ``"nodes[1].force"``, ``"static_friction.initial"``,
        ``"l.slope"``, ``"B.w"``; default: what the records can tell. For a law given as first guess: default as for its
        class.
    fixed : numbers to hold, by name.
    pieces : linear pieces of ``PiecewiseLinear``, ``TwoBranch`` and ``Tabulated``, alone or as kinetic part of `Combined`,
        1 to 12, default 3; or ``"auto"``: the fewest that predict held-back parts of the records as well as any number of
        them; the first of the notes says why.
    offset : whether a constant in the measured force is fitted too: the zero of an instrument, or friction that differs by
        the sense of the slip. The records must slip in both.
    bounds : lowest and highest value of numbers that are fitted, by name.
    ties : numbers that follow another, such as ``{"static.kinetic": "kinetic.break_away"}`` of `Combined`; ``{}``: none does,
        and all are fitted. Default: those of the first guess, said in `notes`; a number that is named in `free` follows none.

    Returns
    -------
    Identification: ``.law``, ``.parameters``, ``.covariance``, ``.rms``, ``.notes``, ``.report()``, ``.save(path)``.

    Records that hold no motion with sticks tell no memory. Where no law is asked for, the result is then that of
    :func:`~stickslip.identification.fit_steady` for friction over slip velocity, of
    :func:`~stickslip.identification.fit_velocity_step` or :func:`~stickslip.identification.fit_velocity_steps` for steps of
    the speed, and of :func:`~stickslip.identification.fit_static_friction` for tables of break-aways. ``stickslip identify``
    chooses in the same way.

    Raises
    ------
    InputError
        for records that cannot identify the law asked for, with the reason.

    Limits: intervals hold the noise of the records and its correlation from sample to sample, not errors of the rig's
    constants (mass, stiffness, damping, drive velocity), which shift friction as a whole. Where slips are sparse they
    rest on few independent rows and are wide.

    The slip velocity and an indirect force have their errors from one displacement, which is taken into account to first
    order (:mod:`stickslip.identification.kinetic.displacement_error`). Errors of ``BogaczRyczek`` hold the scatter of
    cycles, not bias:
    ``static_friction.initial`` is too low by several of its errors (`notes` say so). The interval of a break-away force that
    kinetic friction hardly falls from is too narrow.
    :func:`stickslip.identification.fit_trajectories` goes on from here without that error, where the motion is steady.

    Source: least squares on the branches after Sections 4 to 6 of the paper; the sandwich of scale and correlation time
    is our own; clustered by cycles after Bell & McCaffrey, Survey Methodology 28 (2002) 169.

    >>> import numpy as np
    >>> import stickslip as ss
    >>> import xarray as xr
    >>> system = ss.Oscillator(damping=0.05, drive_velocity=0.2, law=ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6))
    >>> orbit = ss.simulate(system, t_end=200)
    >>> t = np.arange(0, 200, 0.05)
    >>> data = orbit.to_xarray(t)[["slip_velocity", "force", "stuck"]]
    >>> data["force"] = data["force"] + 0.01 * np.random.default_rng(0).standard_normal(t.size)
    >>> sticks = orbit.events[orbit.events["kind"] == "release"]
    >>> rows = {name: ("event", sticks[name].to_numpy()) for name in ("t", "stick_time", "force_rate", "force")}
    >>> found = identify(xr.DataTree.from_dict({"/": data, "/break_away": xr.Dataset(rows)}), law="StaticKinetic")
    >>> found.parameters["value"].round(2).to_dict()
    {'break_away': 1.0, 'kinetic': 0.6}
    """
    path = fit_of(friction, law)
    if path != "motion":
        words, fit = FITS[path]
        given = {"free": free, "fixed": fixed, "pieces": pieces, "offset": offset, "bounds": bounds, "ties": ties}
        for name, value in given.items():
            if value:
                raise InputError(f"identify: {name} does not go with {words}: leave {name} out")
        return fit_steady(friction, _name(law)) if path == "curve" else fit(friction)
    records = read_records(friction)
    options = Options(
        free if free is None or isinstance(free, str) else list(free),
        fixed or {},
        pieces,
        offset,
        bounds or {},
        ties,
    )
    return _by_default(records, options) if law is None else _of_kind(records, law, options)


def _name(law: str | type[Law] | Law | None) -> str | None:
    if law is None or isinstance(law, str):
        return law
    return law.__name__ if isinstance(law, type) else type(law).__name__


def _of_kind(
    records: list[FrictionRecord],
    law: str | type[Law] | Law,
    options: Options,
    break_aways: BreakAways | None = None,
) -> Identification:
    if options.pieces == "auto":
        return choose_pieces(records, law, options)
    return fit_law(records, law, options, break_aways)


def _with_a_curve(
    records: list[FrictionRecord], options: Options, break_aways: BreakAways, constant: Identification
) -> Identification | None:
    """The same static friction beside kinetic friction that changes with the slip velocity, where it lies clearly closer.

    A straight line where that is close enough: a curve of more numbers could not be found from these records.
    """
    off = _distance(constant)
    if off < CURVED * _distance(constant, free=True):
        return None
    line, curve = CURVES[type(constant.law)]
    nearest, near = None, math.inf
    for kind, tried in ((line, replace(options, pieces=options.pieces or 1)), (curve, options)):
        try:
            found = _of_kind(records, kind, tried, break_aways)
        except InputError:
            continue
        scale = found.parameters.filter(regex=r"scale$", axis=0)  # a fall over no known speed is no curve
        if (scale["error"] > scale["value"]).any():
            continue
        if near > CURVED * (away := _distance(found)):
            nearest, near = found, away
        if near < CURVED * _distance(found, free=True):
            break
    return nearest if off > CURVED * near else None


def _distance(found: Identification, free: bool = False) -> float:
    """Of measured forces from the kinetic friction of a law: the rms of the nearest nine tenths, the mean over records.

    Beside w = 0 the others may be adhesion, of which a law with a curve is as far as one without. `free`: from the medians of
    the forces themselves in ranges of speed.
    """
    product = 1.0
    for record in found.records:
        w, force = record.slip_velocity[~record.stuck], record.force[~record.stuck]
        off = np.sign(w) * force - found.law.kinetic_force(np.abs(w))
        if free:
            for part in np.array_split(np.argsort(np.abs(w)), SPEED_RANGES):
                off[part] -= np.median(off[part]) if part.size else 0.0
        nearest = np.sort(np.abs(off))[: len(off) - len(off) // 10]
        product *= float(np.sqrt(np.mean(nearest**2))) ** (1 / len(found.records))
    return product


def _by_default(records: list[FrictionRecord], options: Options) -> Identification:
    """The law whose static friction has the form that the break-aways show; a simpler one where they show none."""
    break_aways = BreakAways(records)
    kinds: list[type[Law]] = [StaticKinetic, Coulomb]
    if (static := break_aways.static) is None:
        why = why_no_growth(break_aways.rows)
    else:
        why = f"static friction over stick time has the {static.chosen} form"
        if notes_on_unlike_records(static.rows, static.fits):
            why = "the records differ from any one law of stick time"
        elif one_rate(static.rows) and static.chosen != "constant":
            # What looks like growth within one record may be scatter along its loading line. Where several drive velocities
            # tie stick time and force rate to each other, growth still predicts what comes at any of them.
            why = "growth with stick time cannot be separated from an effect of the force rate in these records"
        else:
            near = static.of_a_law
            kinds.insert(0, BY_FORM.get(near.chosen, DwellTime))
            others = [form for form in static.alternatives if BY_FORM.get(form, DwellTime) is not kinds[0]]
            if near.chosen in static.alternatives:
                why += f", which no law has and these break-aways hardly separate from the {near.chosen} form"
            elif near.chosen != static.chosen:
                off, least = (float(np.sqrt(np.mean(fit.residuals**2))) for fit in (near.best, static.best))
                why += (
                    f", which no law has; of the forms that laws have the {near.chosen} one lies closest (its break-away "
                    f"forces are off by {off:.3g}, those of the other by {least:.3g})"
                )
            elif others:
                why += f", which these break-aways hardly separate from the {others[0]} form"
    refused: list[str] = []
    for kind in dict.fromkeys(kinds):
        try:
            found = _of_kind(records, kind, options, break_aways)
        except InputError as error:
            refused.append(str(error))
            continue
        reason = refused[-1].removeprefix("identify: ") if refused else why
        if kind in CURVES and (curved := _with_a_curve(records, options, break_aways, found)) is not None:
            found, kind = curved, type(curved.law)
            reason += ", and kinetic friction that changes with the slip velocity lies closer to the records"
            kinetic = getattr(curved.law, "kinetic", curved.law)
            if isinstance(kinetic, PiecewiseLinear) and len(kinetic.nodes) == 2:
                (w, force), (last, end) = kinetic.nodes
                slope = (end - force) / (last - w)
                reason += f": the line {force:.4g} {'-' if slope < 0 else '+'} {abs(slope):.4g} w"
        return replace(found, notes=[f"No law was requested; {kind.__name__} was taken: {reason}.", *found.notes])
    raise InputError(refused[0])
