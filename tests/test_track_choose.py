"""The page on which a film's markers, scale and region are chosen: what is drawn on it tracks the film."""

import tomllib

import cv2
import numpy as np
import pytest
from browser import Browser

from stickslip.cli.main import main
from stickslip.tracking import track


def pictures(folder):
    rows, columns = np.mgrid[:200, :400]
    folder.mkdir()
    for index in range(40):
        bright = np.full((200, 400), 200.0)
        for x, y, radius in ((100 + 3 * index, 80, 9), (40, 160, 7), (360, 30, 7)):
            bright -= 160 * np.clip(radius + 0.5 - np.hypot(columns - x, rows - y), 0, 1)
        cv2.imwrite(str(folder / f"{index}.png"), np.rint(bright).astype(np.uint8))


def test_several_films_are_refused(tmp_path, capsys):
    assert main(["track", "a.mp4", "b.mp4", "--choose", str(tmp_path / "page.html")]) == 2
    assert "--choose looks at one film, got 2" in capsys.readouterr().err


@pytest.mark.slow
def test_what_is_drawn_on_the_page_tracks_the_film(tmp_path):
    pictures(tmp_path / "film")
    page = tmp_path / "page.html"
    assert main(["track", str(tmp_path / "film"), "--choose", str(page), "--frame-rate", "50"]) == 0
    with Browser(1200, 700) as browser:
        browser.open(page.as_uri())

        def at(x, y):
            return tuple(
                browser.run(
                    f"""(() => {{ const box = document.querySelector('canvas').getBoundingClientRect();
                    return [box.left + ({x} + 0.5) * box.width / 400, box.top + ({y} + 0.5) * box.height / 200]; }})()"""
                )
            )

        browser.drag(at(100, 80), at(109, 80))
        browser.run("document.querySelector('[data-mode=scale]').click()")
        browser.drag(at(40, 160), at(240, 160))
        browser.run("document.getElementById('length').value = 50")
        browser.run("document.querySelector('[data-mode=region]').click()")
        browser.drag(at(20, 40), at(380, 130))
        browser.run("document.querySelector('[data-mode=marker]').click()")
        browser.drag(at(300, 100), at(310, 100))
        browser.run("document.getElementById('undo').click()")
        toml = browser.run("document.getElementById('toml').value")
        saved = browser.run("decodeURIComponent(document.getElementById('save').href.split(',').slice(1).join(','))")
        assert browser.problems == []
    assert saved == toml
    setup = tomllib.loads(toml)
    assert setup["masses"] == 1
    assert setup["size"] == pytest.approx(18, abs=1.5)
    assert setup["calibration"]["length"] == 50
    motion = track(tmp_path / "film", setup)
    assert (motion["lost"] == "").all()
    np.testing.assert_allclose(np.diff(motion["x"].to_numpy()[:, 0]), 3 * 0.05 / 200, rtol=0.02)
