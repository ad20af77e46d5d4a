"""What every test may ask for: the real records, and the same examples from hypothesis on every run."""

import gc
import os
import sys
from pathlib import Path

import hypothesis
import pytest

# Before anything imports pyplot: no test opens a window.
os.environ["MPLBACKEND"] = "Agg"
# Before anything imports NumPy: there is a worker a core already, and threads of BLAS that wait for work take its time.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# A gate that fails by chance is no gate: the same examples every time, however slow the machine.
hypothesis.settings.register_profile("gate", derandomize=True, deadline=None)
hypothesis.settings.load_profile("gate")


def pytest_collection_finish() -> None:
    """What was imported stays: looking through it for garbage again and again takes a twentieth of the time."""
    gc.freeze()


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of the real records: STICKSLIP_DATA, or beside the checkout. Without it the test is skipped."""
    beside = Path(__file__).parents[2] / "shared" / "data"
    folder = Path(os.environ.get("STICKSLIP_DATA") or beside)
    if not folder.is_dir():
        pytest.skip(f"no real records in {folder}: set STICKSLIP_DATA to the folder that holds them")
    return folder


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print the table of known numbers, if its tests ran."""
    reports = [report for outcome in ("passed", "failed") for report in terminalreporter.stats.get(outcome, [])]
    lines = [value for report in reports for name, value in report.user_properties if name == "known number"]
    if lines:
        terminalreporter.section("known numbers: expected, got, relative error")
        terminalreporter.write("".join(f"{line}\n" for line in lines))


@pytest.fixture(scope="session")
def refused():
    """The check that a call is refused, in one sentence that matches."""
    from stickslip import InputError

    def check(sentence, call):
        with pytest.raises(InputError, match=sentence) as caught:
            call()
        assert "\n" not in str(caught.value)

    return check


@pytest.fixture(autouse=True)
def figures_closed():
    """What a test drew is closed behind it: pyplot warns from the twentieth figure on, whichever tests drew them."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    """The explorer's page, from a file."""
    from stickslip.explorer import page

    path = tmp_path_factory.mktemp("explorer") / "page.html"
    path.write_text(page(), encoding="utf-8")
    return path.as_uri()


@pytest.fixture(scope="module")
def browser():
    """A headless browser."""
    from browser import Browser

    with Browser() as browser:
        yield browser


@pytest.fixture
def fresh(browser, address):
    """The explorer's page just loaded, still."""
    browser.problems.clear()
    browser.resize(1440, 900)
    browser.open(address)
    browser.run("explorer.play(false)")
    yield browser
    assert browser.problems == []


@pytest.fixture
def opened(browser, address):
    """The explorer's page as it opens, still: the page of the test before, brought back, where nothing is left on it."""
    from explorer_page import FRAME

    browser.problems.clear()
    browser.resize(1440, 900)
    if browser.run("location.href.replace(/#.*/, '')") != address or not browser.run(
        "!(explorer.carry || explorer.records.length || explorer.lessons.at || explorer.sound.on)"
    ):
        browser.open(address)
    browser.run("explorer.play(false), explorer.open('#stick-slip'), explorer.seek(0)")
    browser.run("scrollTo(0, 0), document.getElementById('panels').scrollTo(0, 0)")
    browser.run(FRAME)
    yield browser
    assert browser.problems == []
