"""The site: no page scrolls sideways on a phone, no picture is missing, and nothing is fetched from the network."""

import subprocess
import sys
from pathlib import Path

import pytest
from browser import Browser

DOCS = Path(__file__).parents[1] / "docs"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    subprocess.run(
        [sys.executable, "-m", "sphinx", "--quiet", "--jobs", "auto", "-b", "html", DOCS, folder], check=True
    )
    return folder


@pytest.mark.slow
def test_every_page_fits_a_phone_and_needs_no_network(site):
    pages = [page for page in site.rglob("*.html") if not page.relative_to(site).parts[0].startswith("_")]
    assert len(pages) > 40
    wrong = {}
    with Browser() as browser:
        browser.resize(400, 800, touch=True)
        for page in pages:
            browser.send("Page.navigate", url=page.as_uri())
            browser.wait(f"document.readyState === 'complete' && location.href.startsWith('{page.as_uri()}')")
            found = [
                browser.run("document.documentElement.scrollWidth > 400"),
                browser.run("[...document.images].some(image => !image.complete || image.naturalWidth === 0)"),
                browser.run("performance.getEntriesByType('resource').some(one => !one.name.startsWith('file:'))"),
            ]
            if any(found):
                wrong[str(page.relative_to(site))] = found
    assert not wrong
