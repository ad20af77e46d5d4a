"""What each calibration shows of the paper, as one picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import ListedColormap

from stickslip.paper.calibration import CALIBRATIONS, trades
from stickslip.paper.claim import NOT, PARTLY, REPRODUCED, STATED
from stickslip.paper.figures.motion import TITLE
from stickslip.paper.scoring import claims
from stickslip.show import OKABE_ITO, new_axes

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

#: From the worst verdict to the best one: its colour, which is told apart in grey, and the word for it.
_VERDICTS = {NOT: ("#FFFFFF", "no"), PARTLY: (OKABE_ITO["sky"], "partly"), REPRODUCED: (OKABE_ITO["blue"], "")}


def trade_offs(table: pd.DataFrame | None = None) -> list[Axes]:
    """The verdicts of all claims by calibration, and f_s(0, δ) and the damping of each calibration.

    Parameters
    ----------
    table : from :func:`stickslip.paper.calibration.trades`; default of all calibrations, which takes minutes.
    """
    table = trades() if table is None else table
    calibrations, rows = [str(name) for name in table], [str(name) for name in table.index]
    above, below = new_axes(2, 1, figsize=(7.0, 10.2), height_ratios=(1.75, 1))
    order = list(_VERDICTS)
    cells = table.map(order.index).to_numpy()
    colours = ListedColormap([colour for colour, _ in _VERDICTS.values()])
    above.pcolormesh(cells, cmap=colours, vmin=0, vmax=len(order) - 1, edgecolors="0.85", lw=0.8)
    for row, column in np.argwhere(cells < len(order) - 1):
        word = _VERDICTS[order[cells[row, column]]][1]
        above.text(column + 0.5, row + 0.5, word, ha="center", va="center", fontsize=7.5)
    source = claims()["source"].to_dict()
    above.set_yticks(np.arange(len(rows)) + 0.5, [name if source[name] == STATED else f"{name} *" for name in rows])
    shown = (cells == order.index(REPRODUCED)).sum(axis=0)
    titles = [f"{name} ({count})" for name, count in zip(calibrations, shown, strict=True)]
    above.set_xticks(np.arange(len(titles)) + 0.5, titles)
    above.tick_params(length=0)
    above.tick_params(axis="x", rotation=40)
    for text in above.get_xticklabels():
        text.set(ha="right", rotation_mode="anchor")
    above.invert_yaxis()
    above.set_title("reproduced (blue) by each calibration; * inferred by us, not stated", **TITLE)
    delta = np.linspace(0.2, 0.45, 301)
    curves: dict[bytes, list[str]] = {}
    for name in calibrations:
        # Those with the same f_s(0, δ) are one curve.
        curves.setdefault(CALIBRATIONS[name].law.break_away_force(0.0, delta).tobytes(), []).append(name)
    for curve, names in curves.items():
        said = [f"{name}: d = {CALIBRATIONS[name].damping:g}" for name in names]
        below.plot(delta, np.frombuffer(curve), label="\n".join(said))
    slope, intercept = CALIBRATIONS["default"].law.l
    s = np.array([0.32, 0.45])
    below.plot(s, slope * s + intercept, color=OKABE_ITO["grey"], lw=0.9, ls="--", label="l at w = δ = s")
    below.legend(loc="lower left", fontsize=8, frameon=False, ncols=2)
    below.margins(x=0)
    below.set(xlabel="force rate δ (dimensionless)", ylabel="friction $f_s(0, δ)$ (dimensionless)", ylim=(0.2, None))
    below.set_title("static friction without rest, and damping", **TITLE)
    return [above, below]
