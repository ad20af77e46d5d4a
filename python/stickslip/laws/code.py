"""A law as the text of a function, to be pasted into a simulator."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from stickslip._core import __version__
from stickslip.errors import InputError, did_you_mean, number, positive
from stickslip.laws.law import Law, force_along
from stickslip.laws.state_law import StateLaw
from stickslip.laws.tabulation import from_function

PYTHON = '''"""{head}"""

from bisect import bisect_right

STATIC = ({static[0]!r}, {static[1]!r})  # forward, backward
FORWARD = {nodes[0]}
BACKWARD = {nodes[1]}


def friction(w, load):
    """Friction on the mass at slip velocity w; at w = 0 it balances the load, up to static friction."""
    if w == 0.0:
        return max(-STATIC[1], min(STATIC[0], load))
    speeds, forces = FORWARD if w > 0.0 else BACKWARD
    speed = abs(w)
    i = min(max(bisect_right(speeds, speed), 1), len(speeds) - 1)
    share = (speed - speeds[i - 1]) / (speeds[i] - speeds[i - 1])
    force = forces[i - 1] + share * (forces[i] - forces[i - 1])
    return force if w > 0.0 else -force
'''

C = """/* {head} */

static const double forward_w[] = {{{nodes[0][0]}}};
static const double forward_f[] = {{{nodes[0][1]}}};
static const double backward_w[] = {{{nodes[1][0]}}};
static const double backward_f[] = {{{nodes[1][1]}}};

/* Friction on the mass at slip velocity w; at w = 0 it balances the load, up to static friction. */
double friction(double w, double load)
{{
    const double *speeds = w > 0 ? forward_w : backward_w;
    const double *forces = w > 0 ? forward_f : backward_f;
    const int last = (int)((w > 0 ? sizeof forward_w : sizeof backward_w) / sizeof(double)) - 1;
    const double speed = w < 0 ? -w : w;
    double force;
    int i = 1;
    if (w == 0)
        return load > {static[0]!r} ? {static[0]!r} : load < -{static[1]!r} ? -{static[1]!r} : load;
    while (i < last && speeds[i] <= speed)
        i++;
    force = forces[i - 1] + (speed - speeds[i - 1]) / (speeds[i] - speeds[i - 1]) * (forces[i] - forces[i - 1]);
    return w > 0 ? force : -force;
}}
"""

LANGUAGES = {"python": PYTHON, "c": C}

BESIDE = {
    "offset": "{offset!r}",
    "restoring": "{restoring!r} * (x - {position!r})",
    "gravity_sine": "{gravity_sine!r} * sin(x)",
    "gravity_cosine": "{gravity_cosine!r} * cos(x)",
    "inertia": "{inertia!r} * a",
}
"""What a measured force may hold beside friction, at position x and acceleration a; `position` is the zero of a spring."""
SAYS_BESIDE = "What the measured force holds beside friction, at position x and acceleration a; add it to friction."
PYTHON_BESIDE = '''

def beside_friction(x, a):
    """{says}"""
    return {sum}
'''
C_BESIDE = """
/* {says} */
double beside_friction(double x, double a)
{{
    (void)x, (void)a;
    return {sum};
}}
"""


def law_code(
    law: Law,
    language: str,
    w_max: float,
    error: float | None = None,
    stick_time: float | None = None,
    beside: Mapping[str, float] | None = None,
) -> str:
    """The text of a function friction(w, load): f(w) while slipping, the balance of the load up to f_s while stuck.

    Parameters
    ----------
    law : any law whose force while slipping is a function of w.
    language : ``"python"`` or ``"c"``.
    w_max : the largest |w| that will occur; beyond it the last slope goes on.
    error : the largest deviation from the law up to there, in the unit of force; default a ten-thousandth of the static
        friction. Between its nodes the function is linear (:func:`from_function`).
    stick_time : t_s of the static friction; needed where it grows with rest.
    beside : what the measured force holds beside friction, as a fit has it in its attribute ``beside`` and a law file under
        ``[source.beside_friction]``: the text then has a second function, beside_friction(x, a), to be added.

    Returns
    -------
    The text. Its function takes the slip velocity and the force that would hold the mass at w = 0.

    Raises
    ------
    InputError
        where the force while slipping has a memory or a state, or the static friction grows and no stick time is given.

    Limits: a simulator must decide itself when the mass sticks: where w changes its sign while the load is within the
    static friction, w stays 0. One that only evaluates the function slips through.

    >>> from stickslip.laws import StaticKinetic
    >>> names = {}
    >>> exec(law_code(StaticKinetic(1.0, 0.6), "python", w_max=2.0), names)
    >>> names["friction"](-0.1, 0.0), names["friction"](0.0, 3.0), names["friction"](0.0, -0.2)
    (-0.6, 1.0, -0.2)
    """
    if language not in LANGUAGES:
        raise InputError(
            f"law_code: language must be one of {', '.join(LANGUAGES)}, got {language!r}{did_you_mean(language, LANGUAGES)}"
        )
    top, kind = positive("w_max", w_max, "law_code"), type(law).__name__
    if isinstance(law, StateLaw):
        raise InputError(f"law_code: {kind} has an internal state, which no function of w holds; simulate it here")
    there = np.linspace(0.0, top, 401)[1:]
    path = np.concatenate([[0.0], there, there[::-1]])
    force = force_along(law, np.zeros_like(path), path, path == 0)[1:]
    if not np.allclose(force[: there.size], force[there.size :][::-1], rtol=1e-9):
        raise InputError(
            f"law_code: {kind} has a memory while slipping, which no function of w holds; simulate it here"
        )
    rest = 0.0 if stick_time is None else number("stick_time", stick_time, "law_code")
    static = [law.break_away_force(rest, direction * 1e-300) for direction in (1.0, -1.0)]
    if stick_time is None and law.break_away_force(1e9) > static[0] * (1 + 1e-9):
        raise InputError(
            f"law_code: the static friction of {kind} grows with rest; give the stick_time (--stick-time) "
            "of which it is to be"
        )
    bound = 1e-4 * static[0] if error is None else positive("error", error, "law_code")
    tiny = 1e-12 * top  # f(0+) where a function of w asks for f(0)

    def nodes_toward(direction: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
        def speeding(speed: Any) -> Any:
            return direction * law.kinetic_force(direction * np.maximum(speed, tiny))

        curve = from_function(speeding, top, error=bound).nodes
        pairs = curve if len(curve) > 1 else (*curve, (top, curve[0][1]))
        return tuple(w for w, _ in pairs), tuple(f for _, f in pairs)

    nodes = [nodes_toward(1.0), nodes_toward(-1.0)]
    head = f"Friction of a law {kind}, written by stickslip {__version__}: within {bound:.3g} of the law up to |w| = {top:g}."
    listed = nodes if language == "python" else [tuple(", ".join(map(repr, row)) for row in pair) for pair in nodes]
    return LANGUAGES[language].format(head=head, static=static, nodes=listed) + _beside(beside or {}, language)


def _beside(numbers: Mapping[str, float], language: str) -> str:
    """The second function of the text, empty where there is nothing beside friction."""
    if unknown := [name for name in numbers if name not in (*BESIDE, "position")]:
        raise InputError(
            f"law_code: unknown force beside friction {unknown[0]!r}{did_you_mean(unknown[0], BESIDE)}; known are "
            f"{', '.join(BESIDE)}"
        )
    given = {name: number(name, one, "law_code") for name, one in numbers.items()}
    if not given:
        return ""
    total = " + ".join(BESIDE[name].format(**{"position": 0.0} | given) for name in BESIDE if name in given)
    if language == "python":
        needs = "from math import cos, sin\n" if "(x)" in total else ""
        return ("\n\n" + needs if needs else "") + PYTHON_BESIDE.format(says=SAYS_BESIDE, sum=total)
    needs = "\n#include <math.h>\n" if "(x)" in total else ""
    return needs + C_BESIDE.format(says=SAYS_BESIDE, sum=total)
