"""All figures of the paper and all its claims, from our model, on one page."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.explorer import content_of_system
from stickslip.files.disk import make_folder, write_text, write_whole
from stickslip.model.drive import Harmonic
from stickslip.paper.calibration import CALIBRATIONS
from stickslip.paper.checks import CLAIMS
from stickslip.paper.claim import NOT, PARTLY, REPRODUCED, STATED
from stickslip.paper.default_calibration import DAMPING, oscillator
from stickslip.paper.scoring import score

if TYPE_CHECKING:
    import pandas as pd

#: The calibration that shows most of the paper; the default has three free numbers fewer.
BEST = "two steps"

_COLUMNS = ["section", "claim", "source", "evidence", "basis", "verdict", BEST]

#: What the words of the table mean.
LEGEND = (
    "Every claim is in our words. The source says whether the paper states it or what of it we infer. The basis says what a "
    "success rests on. Calibration: a number that the paper leaves open was chosen so that it comes out. Reading: our "
    "reading of the law says so by construction. Follows: nothing was chosen for it. Verdict and evidence are of the default "
    f"calibration. The last column has the verdicts on the calibration `{BEST}`."
)


#: Drive velocity and forcing of the motions into which figures of the report turn where scripts run.
LIVE: dict[str, tuple[float, Harmonic | None]] = {
    "fig-12-phase-portraits": (0.2, None),
    "fig-13-forced-motions": (0.3, Harmonic(0.03, 1.25)),
    "fig-14-regimes": (0.2494, None),
}


def reproduce(folder: str | Path, progress: Callable[[str, int, int], Any] | None = None, **options: Any) -> Path:
    """Draw every figure of the paper from our model and score every claim, on one self-contained page.

    Parameters
    ----------
    folder : where ``paper.html``, ``claims.csv``, ``claims.json``, ``paper.md`` and ``figures/`` go; made if it is
        not there.
    progress : called as ``progress(what, done, steps)`` before each step.
    options : of :func:`stickslip.paper.score`, such as ``only`` or ``forcing_periods``.

    Returns
    -------
    The path of the page.

    Raises
    ------
    InputError
        where the folder cannot be made or written to, or an option makes no sense.

    It takes half a minute of one core: a run that was stopped is begun anew. The page is written last; where it is, all the
    rest is.
    """
    import matplotlib

    folder = Path(folder)
    make_folder(folder / "figures")
    with matplotlib.rc_context({"backend": "agg"}):
        return _reproduce(folder, progress or (lambda *_: None), options)


def _reproduce(folder: Path, tell: Callable[[str, int, int], Any], options: dict[str, Any]) -> Path:
    from stickslip.paper.figures import FIGURES
    from stickslip.report.report import Report

    only = options.get("only")
    checked = len(CLAIMS) if only is None else len(only)
    steps = 2 * checked + len(FIGURES)
    tell("score the claims", 0, steps)
    scores = verdicts(lambda done: tell("score the claims", done, steps), **options)
    write_whole(folder / "claims.csv", scores.to_csv)
    law = oscillator(0.3).law.to_dict()
    document = {"law": law, "damping": DAMPING, "claims": _records(scores)}
    text = json.dumps(document, ensure_ascii=False, indent=2, allow_nan=False) + "\n"
    write_text(folder / "claims.json", text)
    report = Report("Almost periodic vibration excited by dry friction: what our model shows of it")
    count = {verdict: str(int((scores["verdict"] == verdict).sum())) for verdict in (REPRODUCED, PARTLY, NOT)}
    report.summary(summary(scores) + " The oscillator is dimensionless (the paper's Eqs. 2, 6 and 10).", count)
    report.heading("Claims")
    report.text(LEGEND)
    report.table(scores[_COLUMNS], mark="verdict")
    report.text("What is looked at for each, and when it counts as reproduced:")
    report.table(scores[["measured", "threshold"]])
    report.heading("Figures")
    report.text(
        "The paper's figures are not available to us; of each it is said what it shows and what to see in ours, which is "
        "drawn from our model."
    )
    for done, (name, figure) in enumerate(FIGURES.items(), start=2 * checked):
        tell(f"draw {name}", done, steps)
        axes = figure.draw()
        drawn = (axes[0] if isinstance(axes, list) else axes).get_figure(root=True)
        assert drawn is not None
        write_whole(
            folder / "figures" / f"{name}.png",
            partial(drawn.savefig, format="png", dpi=130, metadata={"Software": None}),
        )
        shown = LIVE.get(name)
        live = None if shown is None else content_of_system(oscillator(shown[0], forcing=shown[1]), 150.0)
        report.figure(drawn, f"Fig. {int(name[4:6])}. {figure.paper} {figure.see}", live, "rig,law,phase,displacement")
    write_text(folder / "paper.md", markdown(scores))
    report.heading("What is fact, reading, calibration")
    report.items(_kinds())
    report.heading("The law and its numbers")
    report.code(f"damping = {DAMPING}\n" + "\n".join(f"{key} = {value}" for key, value in law.items()))
    report.heading("To do it again")
    report.code("stickslip reproduce -o FOLDER")
    tell("done", steps, steps)
    return report.write(folder / "paper.html")


def verdicts(progress: Callable[[int], Any] | None = None, **options: Any) -> pd.DataFrame:
    """The scores of the default, with a column of the verdicts on the calibration :data:`BEST`.

    Parameters
    ----------
    progress : called as ``progress(done)`` after each claim of either.
    options : of :func:`stickslip.paper.score`.
    """
    done = itertools.count(1)
    tell = progress or (lambda _: None)
    scores, best = (
        score(CALIBRATIONS[name].oscillator, progress=lambda *_: tell(next(done)), **options)
        for name in ("default", BEST)
    )
    return scores.assign(**{BEST: best["verdict"]})


def summary(scores: pd.DataFrame) -> str:
    """How many claims came out, in three sentences."""
    count = {verdict: int((scores["verdict"] == verdict).sum()) for verdict in (REPRODUCED, PARTLY, NOT)}
    stated = scores[scores["source"] == STATED]
    shown = int((stated["verdict"] == REPRODUCED).sum())
    best = int((scores[BEST] == REPRODUCED).sum())
    return (
        f"Of {len(scores)} claims {count[REPRODUCED]} are reproduced, {count[PARTLY]} partly, {count[NOT]} not. "
        f"Of the {len(stated)} among them that the paper states {shown} are reproduced. "
        f"With the calibration `{BEST}`, which has three more free numbers, {best} of all are."
    )


def markdown(scores: pd.DataFrame) -> str:
    """The page of the documentation: the table of claims and the figures with their sentences.

    Parameters
    ----------
    scores : from :func:`verdicts`.
    """
    from stickslip.paper.figures import FIGURES

    lines = [
        "# The paper's claims and figures, from our model",
        "",
        "Written by `stickslip reproduce`; the same as a page of HTML is `paper.html` beside it. "
        "[The paper's law](paper-law.md) says what is fact, reading and calibration.",
        "",
        summary(scores) + " " + LEGEND,
        "",
        f"| id | section | the paper says | verdict | evidence | basis | source | {BEST} |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, row in scores.iterrows():
        cells = (
            f"`{name}`",
            row["section"],
            row["claim"],
            row["verdict"],
            row["evidence"],
            row["basis"],
            row["source"],
            row[BEST],
        )
        lines.append("| " + " | ".join(map(_cell, cells)) + " |")
    lines += ["", "## How each is checked", "", "| id | what is looked at | counts as reproduced |", "|---|---|---|"]
    lines += [f"| `{name}` | {_cell(row['measured'])} | {_cell(row['threshold'])} |" for name, row in scores.iterrows()]
    lines += ["", "## Figures", "", "Fig. 1 is a sketch of the oscillator.", ""]
    for name, figure in FIGURES.items():
        number = int(name[4:6])
        lines += [f"**Fig. {number}.** *{figure.paper}* {figure.see}", "", f"![Fig. {number}](figures/{name}.png)", ""]
    return "\n".join(lines).rstrip() + "\n"


def _cell(text: object) -> str:
    return str(text).replace("|", "\\|")


def _records(scores: pd.DataFrame) -> list[dict[str, Any]]:
    rows = scores.reset_index().to_dict("records")
    return [{str(key): None if value != value else value for key, value in row.items()} for row in rows]


def _kinds() -> list[str]:
    return [
        "Fact: the angles φ = −58°, ψ = 39°, η = 89°, the points B (−0.41; 1.33) and D (0.33; 2.40), the line l, β = 0.01, "
        "Eq. (7), the equations of motion.",
        "Reading: which line is followed when, where they join, what a turn of ẇ does, and that the force rate δ of Eq. (7) "
        "is that of the moment of the turn.",
        "Calibration: the damping d, the surface f_s(t_s, δ), the curve α(f_s) and u₀, which the paper does not state or "
        "whose figures are lost.",
    ]
