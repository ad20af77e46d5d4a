"""What friction may do right after a break-away, too soon to be seen: how late releases are, and how far off friction is."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from stickslip.files.arrays import Array
from stickslip.measurement.indirect.force import Friction, Release
from stickslip.measurement.indirect.sticks.resting_sticks import FEW_PER_PERIOD
from stickslip.measurement.indirect.sticks.stick import Stick
from stickslip.measurement.signals.piecewise_fit import OscillatorConstants
from stickslip.measurement.signals.presmooth import natural_period

LONGEST_PERIODS = 0.75
"""So much of a period of the free mass is looked at in each slip: what follows tells of other things than the release."""

FEWEST_SAMPLES, MOST_SLIPS = 6, 64
"""Fewest samples of a slip that tell something of it, and most slips that are looked at, spread over the record."""

HALVINGS = 6
"""Friction may change over the fastest slip speed, and over this many halves, each of the one before."""

AMPLITUDES = np.geomspace(0.003, 0.5, 8)
"""Standard deviations of such changes beforehand, in jumps of the force at a break-away, each as likely as the next."""

MOST_ABOVE = 1 / 3
"""Standard deviation beforehand of friction as a slip begins about its mean, in jumps: the force jumps, so it is below it."""

SHIFTS = np.arange(-12.0, 5.0)
"""Shifts of all releases that are tried, in the time over which the motion is linear in a shift."""

UNEVEN = 2.0
"""One size A of all changes is too even: a fall at one slip speed moves releases by so much more than A tells."""

NEGLIGIBLE = 1e-4
"""Shifts that are less probable than this are left out."""

OPEN = 0.6
"""Standard deviation beforehand of the square of the share of a sample for which a shutter, or a converter, is open."""

FINE = 200
"""Times at which the motion of one slip is integrated."""

SPEED_RANGES = 12
"""Ranges of slip speed, each of as many samples, in which measured friction is compared with the curve."""


def with_hidden_fall(friction: Friction, sticks: list[Stick]) -> Friction:
    """The friction with `late` and `force_error` as wide as a fall of friction that smoothing hides makes them.

    A fall of friction over slip speeds that are passed within a sample or two and a later release look alike in one slip,
    and smoothing takes the one for the other. But all slips of a record share one curve of friction,

        f(w) = c + a_0 w / W + sum_j a_j exp(-2^j w / W),    a_j ~ N(0, A^2),

    with a constant c and a release of their own for each slip, and W the fastest slip speed. With w(t) as measured the motion
    is linear in these numbers about a given shift of all releases. So the posterior of the mean release follows for each
    of `SHIFTS` and `AMPLITUDES`, and each counts by its evidence. To the errors of friction is added how far its mean is off
    the curve, and what is not known of the curve, at its slip speed: where friction is constant in motion as far as the
    record tells, A is small and so are these; where it changes, it may change as much where nothing is seen.

    Where no curve makes the record likelier than constant friction does, the releases of the slips are those of constant
    friction, and their errors those of the fit of it: they scatter about a fifth as much as the ends of the sticks.
    A shutter that is open for a share e of the step h between samples shows x + (e h)^2 x''/24, which moves all releases
    together: `late` is what that does to them with e unknown. Where a curve does, the releases stay what they were, and
    `late` is the root mean square distance of the mean release from the one used, times `UNEVEN`, beyond what the errors of
    the single releases leave in their mean. `UNEVEN` was chosen on simulated
    records with exponential falls; of 16 with other seeds, 13 of the intervals then hold the mean release.

    Parameters
    ----------
    friction : of a record without creep in its sticks, at whose ends the force jumps.
    sticks : those sticks.

    Returns
    -------
    The same with other `releases` or `late` and `force_error`; as it is where no slip is long enough, or there is no noise.

    Notes
    -----
    What is wrong in the constants of the rig looks like a change of friction with slip speed too, and widens both.

    Source: evidence of amplitudes: MacKay, Neural Computation 4 (1992) 415, https://doi.org/10.1162/neco.1992.4.3.415.
    """
    slips = _limits(friction, sticks)
    if not slips:
        return friction
    fit, o = friction.fit, friction.fit.oscillator
    samples = np.concatenate([np.arange(slip.samples.start, slip.samples.stop) for slip in slips])
    fastest = float(friction.slip_velocity[samples].max())
    loads = [o.stiffness * slip.level(o, 0.0) + o.damping * o.drive_velocity for slip in slips]
    jump = abs(float(np.median(loads)) - float(np.median(friction.force[samples])))
    if not min(fastest, jump, friction.noise) > 0:
        return friction
    # a shift by this moves x by a fraction of the noise, as x departs from the drive with jump / m
    unit = math.hypot(math.sqrt(friction.noise * o.mass / jump) / 4, fit.step / 8)
    slips = [slip for slip in slips if slip.length > 2 * SHIFTS[-1] * unit + FEWEST_SAMPLES * fit.step]
    if not slips:
        return friction
    curves = [_curve(friction, slips, fastest, jump, shift * unit, unit) for shift in SHIFTS]
    evidences = np.array([curve.evidence for curve in curves])
    likely = np.exp(evidences - evidences.max())
    likely /= likely.sum()
    late, error = 0.0, np.zeros(len(friction.time))
    for curve, share in zip(curves, likely.tolist(), strict=True):
        if share > NEGLIGIBLE:
            late += share * (curve.rms(curve.offset, curve.early) ** 2 + curve.own)
            error += share * _off_curve(friction, slips, curve) ** 2
    changed = replace(friction, force_error=np.hypot(friction.force_error, np.sqrt(error)))
    without = np.array([curve.without for curve in curves])
    if logsumexp(evidences) > logsumexp(without) or natural_period(o) < FEW_PER_PERIOD * fit.step:
        held = sum(slip.error**2 for slip in slips) / len(slips) ** 2
        return replace(changed, late=math.sqrt(max(UNEVEN**2 * late - held, 0.0)))
    shares = np.exp(without - logsumexp(without))
    # each release, and the force at it: both with their spread over the shifts
    releases = np.array([curve.releases for curve in curves])
    means = np.tensordot(shares, releases, 1)
    spread = np.sqrt(np.tensordot(shares, (releases - means) ** 2 + np.array([curve.variances for curve in curves]), 1))
    found = [Release(*one) for one in np.column_stack([means, spread])[:, [0, 2, 1, 3]].tolist()]
    blurred = float(shares @ np.array([curve.blurred for curve in curves])) * OPEN * fit.step**2 / 24
    return replace(
        changed,
        releases={slip.start: one for slip, one in zip(slips, found, strict=True)},
        late=abs(blurred),
    )


@dataclass(frozen=True)
class _Limits:
    """A slip as it was measured.

    Attributes
    ----------
    samples : of the record.
    start, length : when it begins, and for how long it is looked at.
    path, above : u = V t - x when it begins, by the samples of its stick alone, and that of the fit minus it. The fit has
        the samples of the slip in it, which would then count twice.
    speeds : (FINE,) slip speeds at even times since then.
    origin : time at which u = -x.
    error, path_error : standard errors of `start` and of `path`.
    """

    samples: slice
    start: float
    length: float
    path: float
    above: float
    speeds: Array
    origin: float
    error: float
    path_error: float

    def level(self, o: OscillatorConstants, shift: float) -> float:
        """x where the slip begins so much later."""
        return o.drive_velocity * (self.start + shift - self.origin) - self.path


@dataclass(frozen=True)
class _Slip:
    """The motion of one slip, x = known + moves @ (shift, c, path) + changes @ a.

    Attributes
    ----------
    rest : (n,) x minus what is known; these three are times the roots of the weights of the samples.
    moves : (n, 3) what a later release adds to x, per s, what friction adds, per N, and a higher path of the stick.
    changes : (n, numbers) what each change of friction adds, per N.
    bent : (n,) the second derivative of x.
    """

    rest: Array
    moves: Array
    changes: Array
    bent: Array


@dataclass(frozen=True)
class _Curve:
    """The changes of friction that the slips share, for one shift of all releases.

    Attributes
    ----------
    evidence, without : logarithm of the probability of the record with the changes and without any.
    fastest : W.
    weights, means, covariances : of the numbers a for each amplitude.
    offset, early : mean release minus the one used without a change, and what one of each number adds to it, in s.
    own : variance of that mean by the noise of the slips alone.
    blurred : what is added to that mean by one of x'' that is added to x, in s.
    releases, variances : (slips, 2) the release of each slip without a change, after the one used, in s, and the force there,
        above the one at the release used, in N; their variances.
    constants, raised : constant friction of each slip without a change, and what one of each number adds to it.
    """

    evidence: float
    without: float
    fastest: float
    weights: Array
    means: Array
    covariances: Array
    offset: float
    early: Array
    own: float
    blurred: float
    releases: Array
    variances: Array
    constants: Array
    raised: Array

    def rms(self, value: float, rows: Array) -> float:
        """Root mean square of value + rows @ a."""
        squares = (value + self.means @ rows) ** 2 + (self.covariances @ rows) @ rows
        return math.sqrt(float(self.weights @ squares))


def _changes(speeds: Array) -> Array:
    """What one of each number changes friction by at slip speeds in units of W, (n, numbers)."""
    return np.column_stack([speeds, np.exp(-np.outer(speeds, 2.0 ** np.arange(1, HALVINGS + 1)))])


def _limits(friction: Friction, sticks: list[Stick]) -> list[_Limits]:
    """Slips whose break-aways are in the record and sure, of those with samples enough."""
    fit = friction.fit
    ends = [*(stick.start - fit.step for stick in sticks[1:]), float(fit.time[-1])]
    longest = LONGEST_PERIODS * natural_period(fit.oscillator)
    seen = []
    for stick, end in zip(sticks, ends, strict=True):
        length = min(end - stick.end, longest)
        samples = slice(*np.searchsorted(fit.time, [stick.end, stick.end + length]).tolist())
        rest = slice(*np.searchsorted(fit.time, [stick.start, stick.end]).tolist())
        if (
            stick.ends
            and stick.sure
            and np.count_nonzero(fit.weight[samples]) >= FEWEST_SAMPLES
            and fit.weight[rest].any()
        ):
            seen.append((stick, length, samples, rest))
    if not seen:
        return []
    seen = [seen[i] for i in np.unique(np.linspace(0, len(seen) - 1, MOST_SLIPS).astype(int))]
    starts, lengths = np.array([(stick.end, length) for stick, length, *_ in seen]).T
    times = np.linspace(starts, starts + lengths, FINE, axis=1)
    speeds = np.maximum(fit.evaluate(times.ravel(), 1).reshape(times.shape), 0.0)
    limits = []
    for (stick, length, samples, rest), fitted, w in zip(seen, fit.evaluate(starts, 0).tolist(), speeds, strict=True):
        path = float(np.average(fit.path[rest], weights=fit.weight[rest]))
        error = friction.noise / math.sqrt(float(fit.weight[rest].sum()))
        limits.append(
            _Limits(samples, stick.end, length, path, fitted - path, w, float(fit.time[0]), stick.end_error, error)
        )
    return limits


def _own(o: OscillatorConstants) -> tuple[float, complex]:
    """Decay rate and angular frequency of the free mass, imaginary where it does not swing."""
    half = o.damping / (2 * o.mass)
    return half, cmath.sqrt(o.stiffness / o.mass - half**2) or complex(1e-9 * half)


def _slip(friction: Friction, limits: _Limits, fastest: float, shift: float) -> _Slip:
    """A slip that begins so much later than measured."""
    fit, part = friction.fit, limits.samples
    o, drive, root = fit.oscillator, fit.oscillator.drive_velocity, np.sqrt(fit.weight[part])
    at, since = limits.level(o, shift), np.linspace(0.0, limits.length - min(shift, 0.0), FINE)
    half, own = _own(o)
    fades, cosine, sine = np.exp(-half * since), np.cos(own * since), np.sin(own * since) / own
    kicked = (fades * sine).real
    swing = (fades * cosine).real + half * kicked
    free = at * swing + drive * kicked
    # until it is gone from where the two releases differ, the mass gathers speed evenly
    known = np.linspace(0.0, limits.length, FINE)
    joined = 2 * abs(shift) + fit.step
    fast = np.interp(joined + shift, known, limits.speeds)
    speeds = np.where(since < joined, fast * since / joined, np.interp(since + shift, known, limits.speeds))
    forces = np.column_stack([np.ones(FINE), _changes(speeds / fastest)])
    forces[0] /= 2  # the trapezoidal rule; the answer to a kick begins at zero
    answers = np.column_stack([np.convolve(one, kicked)[:FINE] for one in forces.T]) * (since[1] / o.mass)
    # a later release shifts the motion, and the spring is then wound up by as much more at each time
    later = speeds - o.stiffness * drive * answers[:, 0]
    after = fit.time[part] - limits.start - shift
    bent = -np.gradient(speeds, since)
    columns = np.column_stack([free, later, answers[:, 0], -swing, answers[:, 1:], bent])
    seen = np.column_stack([np.interp(after, since, one) for one in columns.T])
    seen[after <= 0] = 0.0
    seen[after <= 0, 0] = (at + drive * after)[after <= 0]
    seen[after <= 0, 3] = -1.0
    seen *= root[:, None]
    x = drive * (fit.time[part] - fit.time[0]) - fit.path[part]
    return _Slip(root * x - seen[:, 0], seen[:, 1:4], seen[:, 4:-1], seen[:, -1])


def _curve(friction: Friction, limits: list[_Limits], fastest: float, jump: float, shift: float, unit: float) -> _Curve:
    """Posterior of the numbers a at this shift of all releases: what is each slip's own taken out, all slips together."""
    size, count, variance, o = HALVINGS + 1, len(limits), friction.noise**2, friction.fit.oscillator
    # the release, and the force at it, by (shift, c, path)
    tells = np.array([[1.0, 0.0, 0.0], [o.stiffness * o.drive_velocity, 0.0, -o.stiffness]])
    square, linear, rest = np.zeros((size, size)), np.zeros(size), 0.0
    offset, early, own, blurred = shift, np.zeros(size), 0.0, 0.0
    releases, variances, constants, raised = [], [], [], []
    for one in limits:
        slip = _slip(friction, one, fastest, shift)
        matrix = slip.moves.T @ slip.moves / variance
        matrix[0, 0] += 1 / (unit**2 + one.error**2)
        matrix[2, 2] += 1 / one.path_error**2
        covariance = np.linalg.inv(matrix)
        inverse = covariance @ slip.moves.T / variance
        mine, mine_rows = inverse @ slip.rest, inverse @ slip.changes
        rows, residuals = slip.changes - slip.moves @ mine_rows, slip.rest - slip.moves @ mine
        square += slip.changes.T @ rows / variance
        linear += slip.changes.T @ residuals / variance
        rest += float(slip.rest @ residuals) / variance + np.linalg.slogdet(matrix)[1]
        offset += float(mine[0]) / count
        early -= mine_rows[0] / count
        own += float(covariance[0, 0]) / count**2
        blurred += float(inverse[0] @ slip.bent) / count
        releases.append(tells @ mine + tells[:, 0] * shift + np.array([0.0, o.stiffness * one.above]))
        variances.append(np.sum((tells @ covariance) * tells, axis=1))
        constants.append(float(mine[1]))
        raised.append(-mine_rows[1])
    means, covariances, evidences = [], [], []
    # the force jumps at the release: friction as it begins to slip is well below what it was at rest
    above = _changes(np.zeros(1))[0] + np.mean(raised, axis=0)
    for amplitude in AMPLITUDES * jump:
        prior = np.eye(size) / amplitude**2 + np.outer(above, above) / (MOST_ABOVE * jump) ** 2
        precision = square + prior
        covariances.append(np.linalg.inv(precision))
        means.append(covariances[-1] @ linear)
        evidences.append(0.5 * float(means[-1] @ linear - np.linalg.slogdet(np.linalg.solve(prior, precision))[1]))
    most = max(evidences)
    weights = np.exp(np.array(evidences) - most)
    return _Curve(
        evidence=most + math.log(float(weights.mean())) - 0.5 * rest,
        without=-0.5 * rest,
        fastest=fastest,
        weights=weights / weights.sum(),
        means=np.array(means),
        covariances=np.array(covariances),
        offset=offset,
        early=early,
        own=own,
        blurred=blurred,
        releases=np.array(releases),
        variances=np.array(variances),
        constants=np.array(constants),
        raised=np.array(raised),
    )


def _off_curve(friction: Friction, slips: list[_Limits], curve: _Curve) -> Array:
    """How far measured friction may be off the curve at each sample, of those that speed up and that slow down apart."""
    w, accelerates = friction.slip_velocity, friction.slip_acceleration > 0
    of = np.concatenate([np.arange(slip.samples.start, slip.samples.stop) for slip in slips])
    number = np.repeat(np.arange(len(slips)), [slip.samples.stop - slip.samples.start for slip in slips])
    above = friction.force[of] - curve.constants[number]
    rows = _changes(np.maximum(w[of], 0.0) / curve.fastest) + curve.raised[number]
    error = np.zeros(len(w))
    for faster in (True, False):
        some = np.flatnonzero(accelerates[of] == faster)
        some = some[np.argsort(w[of[some]])]
        parts = [part for part in np.array_split(some, SPEED_RANGES) if len(part)]
        if not parts:
            continue
        speeds = [float(w[of[part]].mean()) for part in parts]
        errors = [curve.rms(-float(above[part].mean()), rows[part].mean(axis=0)) for part in parts]
        side = ~friction.stuck & (accelerates == faster)
        error[side] = np.interp(w[side], speeds, errors)
    return error
