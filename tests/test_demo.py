import re
import sys
from functools import partial

import numpy as np
import pytest

from stickslip import paper
from stickslip.cli.main import main
from stickslip.paper import demo
from stickslip.tracking.video.vision import vision

SCORED = ("end-of-stick-slip", "end-of-oscillation")


@pytest.fixture(
    scope="module",
    params=[pytest.param("short", marks=pytest.mark.long), pytest.param("whole", marks=pytest.mark.slow)],
)
def report(request, tmp_path_factory):
    """The report; the short one of a third of the pictures, without the refinement of the law, with few claims and speeds."""
    folder = tmp_path_factory.mktemp("demo")
    with pytest.MonkeyPatch.context() as patch:
        if request.param == "short":
            patch.setattr(demo, "CAMERA", demo.CAMERA | {"frame_rate": 10.0})
            patch.setattr(demo, "DURATION", 40.0)
            patch.setattr(demo, "fit_trajectories", lambda branches, *_, **__: branches)
            patch.setattr(paper, "score", partial(paper.score, only=SCORED))
            diagram = partial(paper.figures.drive_velocity_diagram, np.linspace(0.1, 0.5, 9), periods=60)
            patch.setattr(paper.figures, "drive_velocity_diagram", diagram)
        assert main(["demo", "-o", str(folder)]) == 0
    return folder / "report.html"


def test_report_needs_no_other_file(report):
    page = report.read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") >= 6
    assert not re.search(r'(src|href)="(?!data:|#)', page)


def test_it_starts_from_films_and_lays_the_truth_beside(report):
    page = report.read_text(encoding="utf-8")
    assert len(list(report.parent.glob("film-*.avi"))) == 3
    assert "places off, px" in page
    assert "the films were tracked" in page


def test_without_the_vision_library_it_says_so_and_goes_on(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    vision.cache_clear()
    assert "pip install stickslip[video]" in demo._no_films()
    seen = demo.see(0.15, tmp_path, seed=1, filmed=False)
    assert seen.facts["force off, % of the largest"] < 2
    assert seen.facts["break-aways"] == seen.facts["true break-aways"] > 3
    assert not list(tmp_path.glob("*.avi"))


def test_identified_stands_beside_true(report):
    page = report.read_text(encoding="utf-8")
    for name in ("static_friction.initial", "phi", "psi", "l.slope", "l.intercept", "B.w", "D.f"):
        assert f"<th>{name}</th>" in page
    # Not all 95 % intervals hold the truth in each draw of the noise, but most do.
    assert page.count('class="yes"') >= 6


def test_paper_thresholds_are_scored(report):
    page = report.read_text(encoding="utf-8")
    for identifier in SCORED:
        row = re.search(rf'<tr class="(\w+)"><th>{identifier}</th>', page)
        assert row is not None
        assert row.group(1) == "reproduced"


def test_folder_that_cannot_be_made(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main(["demo", "-o", str(tmp_path / "file")]) == 2
    assert "choose another folder" in capsys.readouterr().err
