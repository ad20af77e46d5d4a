"""The oscillators of the benchmark as a state machine, as one writes it by hand for a general solver.

x″ + d x′ + x = f(w) + A cos Ωt with w = s − x′, from the stuck start at x = 0. An integrator needs three things of it: the
right-hand side, the guards (each falls through zero at its event) and what follows an event. Plain functions of floats and
arrays, so that Numba can compile them; `odeint.cpp` says the same in C++.
"""

import math

STATIC_KINETIC, RATIONAL, TWO_BRANCHES = 0, 1, 2

# Parameters p: the oscillator, the kind of law, then its numbers.
DAMPING, DRIVE, AMPLITUDE, FREQUENCY, LAW, FIRST, SECOND = range(7)
# Those of the two branches: f_s(t_s, δ), slopes of the upper, common and steep lines, points B, D, the line l, β.
INITIAL, LIMIT, RATE, FORCE_RATE_SCALE, UPPER_SLOPE, COMMON_SLOPE, STEEPEST, B_W, B_F, D_W, D_F, L_SLOPE, L_F, BETA = (
    range(5, 19)
)

# Mode m: direction of slip (0: stuck), line of friction with its ends, sense of the slip acceleration, memory.
DIRECTION, OFFSET, SLOPE, LOW, HIGH, BRANCH, RISING, CORNER_W, CORNER_F, ANCHOR_W, ANCHOR_F, RELEASED, SINCE = range(13)
MODE_SIZE = 13

FALL, UPPER, COMMON, LOWER, CLIMB, STEEP = range(6)
INNER, RELEASE, CAPTURE, CROSSING = range(4)


def holding(t, x, p):
    """The force that adhesion would have to bear."""
    return x + p[DAMPING] * p[DRIVE] - p[AMPLITUDE] * math.cos(p[FREQUENCY] * t)


def break_away(t, p, m):
    """The force that adhesion can bear."""
    if p[LAW] != TWO_BRANCHES:
        return p[FIRST]
    rate = abs(p[DRIVE] + p[AMPLITUDE] * p[FREQUENCY] * math.sin(p[FREQUENCY] * t))
    grown = 1.0 - math.exp(-p[RATE] * (t - m[SINCE]))
    return p[INITIAL] + p[LIMIT] * grown / (1.0 + rate / p[FORCE_RATE_SCALE])


def friction(u, p, m):
    """The friction force at the slip speed u."""
    if p[LAW] == RATIONAL:
        return p[FIRST] / (1.0 + p[SECOND] * u)
    return m[OFFSET] + m[SLOPE] * u


def acceleration(t, x, v, p, m):
    """The acceleration of the mass."""
    if m[DIRECTION] == 0.0:
        return 0.0
    u = m[DIRECTION] * (p[DRIVE] - v)
    return m[DIRECTION] * friction(u, p, m) - p[DAMPING] * v - x + p[AMPLITUDE] * math.cos(p[FREQUENCY] * t)


def guards(t, x, v, p, m):
    """What falls through zero at the events: low end (or adhesion), high end, turn of the slip acceleration."""
    if m[DIRECTION] == 0.0:
        return break_away(t, p, m) - abs(holding(t, x, p)), 1.0, 1.0
    u = m[DIRECTION] * (p[DRIVE] - v)
    if p[LAW] != TWO_BRANCHES:
        return u, 1.0, 1.0
    return u - m[LOW], m[HIGH] - u, -m[RISING] * m[DIRECTION] * acceleration(t, x, v, p, m)


def line(w, f, slope, low, high, branch, m):
    """Friction follows the line through (w, f)."""
    m[OFFSET], m[SLOPE], m[LOW], m[HIGH], m[BRANCH] = f - slope * w, slope, low, high, branch


def anchor(w, f, p, m):
    """The upper line starts at (w, f); it ends where it meets l."""
    m[ANCHOR_W], m[ANCHOR_F] = w, f
    corner = (f - p[UPPER_SLOPE] * w - p[L_F]) / (p[L_SLOPE] - p[UPPER_SLOPE])
    m[CORNER_W], m[CORNER_F] = (corner, p[L_SLOPE] * corner + p[L_F]) if corner > w else (w, f)


def upper(u, p, m):
    """The line at slip speed u while it rises."""
    if m[RELEASED] >= 0.0 and u < m[ANCHOR_W]:
        line(0.0, m[RELEASED], (m[ANCHOR_F] - m[RELEASED]) / m[ANCHOR_W], 0.0, m[ANCHOR_W], FALL, m)
    elif u < m[CORNER_W]:
        line(m[ANCHOR_W], m[ANCHOR_F], p[UPPER_SLOPE], 0.0, m[CORNER_W], UPPER, m)
    else:
        line(m[CORNER_W], m[CORNER_F], p[COMMON_SLOPE], m[CORNER_W], math.inf, COMMON, m)


def lower(p, m):
    """The line below the corner while the slip speed falls."""
    slope = (m[CORNER_F] - p[B_F]) / (m[CORNER_W] - p[B_W])
    line(m[CORNER_W], m[CORNER_F], slope, 0.0, m[CORNER_W], LOWER, m)


def leave(force, direction, p, m):
    """Slip begins at the break-away force."""
    m[DIRECTION], m[RISING] = direction, 1.0
    if p[LAW] == TWO_BRANCHES:
        anchor(p[BETA], force, p, m)
        m[RELEASED] = force
        upper(0.0, p, m)
    else:
        m[OFFSET], m[SLOPE], m[LOW], m[HIGH] = p[SECOND], 0.0, 0.0, math.inf


def turn(u, p, m):
    """The slip acceleration has changed its sign at slip speed u."""
    m[RISING] = -m[RISING]
    f = friction(u, p, m)
    if m[RISING] < 0.0 and (m[BRANCH] == FALL or m[BRANCH] == UPPER):
        offset, slope = m[OFFSET], m[SLOPE]
        lower(p, m)
        low = (f - p[STEEPEST] * u - m[OFFSET]) / (m[SLOPE] - p[STEEPEST])
        m[OFFSET], m[SLOPE] = offset, slope
        line(u, f, p[STEEPEST], max(low, 0.0), u, STEEP, m)
    elif m[RISING] > 0.0 and (m[BRANCH] == LOWER or m[BRANCH] == COMMON) and f < p[INITIAL]:
        slope = p[STEEPEST]
        if u < p[D_W] and f < p[D_F]:
            slope = min((p[D_F] - f) / (p[D_W] - u), slope)
        line(u, f, slope, u, u + (p[INITIAL] - f) / slope, CLIMB, m)


def inner(guard, u, p, m):
    """The slip speed has reached an end of its line, or turned."""
    if guard == 2:
        turn(u, p, m)
    elif guard == 1 and m[BRANCH] == CLIMB:
        high = m[HIGH]
        anchor(high, p[INITIAL], p, m)
        m[RELEASED] = -1.0
        upper(high, p, m)
    elif guard == 1:
        upper(m[HIGH], p, m)
    elif m[BRANCH] == CLIMB and u > m[CORNER_W]:
        line(m[CORNER_W], m[CORNER_F], p[COMMON_SLOPE], m[CORNER_W], math.inf, COMMON, m)
    else:
        lower(p, m)


def follow(guard, t, x, v, p, m):
    """Put the mode after an event into m; returns the kind of event and the velocity after it."""
    if m[DIRECTION] == 0.0:
        leave(break_away(t, p, m), math.copysign(1.0, holding(t, x, p)), p, m)
        return RELEASE, p[DRIVE]
    if guard > 0 or (p[LAW] == TWO_BRANCHES and m[LOW] > 0.0):
        inner(guard, m[DIRECTION] * (p[DRIVE] - v), p, m)
        return INNER, v
    m[SINCE] = t
    need, bears = holding(t, x, p), break_away(t, p, m)
    if abs(need) <= bears:
        m[DIRECTION] = 0.0
        return CAPTURE, p[DRIVE]
    leave(bears, math.copysign(1.0, need), p, m)
    return CROSSING, p[DRIVE]
