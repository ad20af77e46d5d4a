"""Every page of the docs: its blocks of code run in their order, its links lead somewhere, its sentences are short."""

import doctest
import re
import shlex
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from pages import FENCE, blocks, run

from stickslip.cli.main import _parser

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
#: Tables made by scripts and reports for referees are not how-to pages.
EVIDENCE = [*DOCS.glob("evidence/*.md"), DOCS / "paper.md", DOCS / "paper-law.md"]
PAGES = [ROOT / "README.md", *sorted(set(DOCS.rglob("*.md")) - set(EVIDENCE))]
#: Blocks that only a shell or a reader can run: installation, a picture of a file, a directive of the site.
OTHER = {"sh", "bibtex", "", "text"}
AGREES = doctest.OutputChecker()
LOOSE = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def runnable(page):
    """Whether a page has code, as a parameter of a test; pages that say so take longer."""
    slow = "<!-- slow" in page.read_text(encoding="utf-8")
    return pytest.param(page, id=str(page.relative_to(ROOT)), marks=[pytest.mark.slow] if slow else [])


def has_code(page):
    return any(block.kind in ("python", "console", "toml") for block in blocks(page))


@pytest.mark.parametrize("page", sorted((DOCS / "tutorials").glob("*.md")), ids=lambda page: page.stem)
def test_a_tutorial_has_pictures_and_each_is_what_the_block_above_it_draws(page):
    drawn = [block for block in blocks(page) if block.picture]
    assert drawn
    assert len(drawn) == page.read_text(encoding="utf-8").count("](../figures/")
    for block in drawn:
        assert block.picture.startswith(page.stem)
        assert block.plots or re.search(r"^ax = ", block.body, re.MULTILINE), block.picture


@pytest.mark.parametrize("page", [runnable(page) for page in [*PAGES, *EVIDENCE] if has_code(page)])
def test_every_block_runs_and_prints_what_stands_below_it(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    printed = ""
    for block in run(page):
        if block.kind == "text":
            assert AGREES.check_output(block.body, printed, LOOSE), f"expected\n{block.body}\ngot\n{printed}"
        elif block.kind in ("python", "console"):
            printed = block.printed
            assert all(Path(plot).exists() for plot in block.plots)
        else:
            assert block.kind in {*OTHER, "toml"}, f"{page}: no rule for a block of {block.kind!r}"
    plt.close("all")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_commands_with_a_name_to_fill_in_are_ones_of_stickslip(page):
    for block in blocks(page):
        for line in block.body.replace("\\\n", " ").splitlines() if block.kind in ("sh", "") else ():
            if line.startswith("stickslip "):
                assert _parser().parse_args(shlex.split(line, comments=True)[1:]), line


@pytest.mark.parametrize("page", [*PAGES, *EVIDENCE], ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_to_files(page):
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    for link in re.findall(r"\]\(([^)\s#:]+)(?:#[^)\s]*)?\)", text):
        assert (page.parent / link).exists(), link


#: Source files, from a folder of the tree on.
SOURCES = [
    f"/{path}"
    for room in ("crates", "python", "docs", "tests", "benchmarks", "web/src")
    for path in (ROOT / room).rglob("*.*")
]


@pytest.mark.parametrize(
    "page", [*PAGES, *EVIDENCE, ROOT / "ARCHITECTURE.md"], ids=lambda page: str(page.relative_to(ROOT))
)
def test_source_files_that_a_page_names_are_there(page):
    named = re.findall(r"`([\w/]+\.(?:rs|py|ts))`", FENCE.sub("", page.read_text(encoding="utf-8")))
    assert [name for name in named if not any(path.endswith(f"/{name}") for path in SOURCES)] == []


def test_every_page_is_in_the_contents():
    named = set()
    for page in DOCS.rglob("*.md"):
        for listed in re.findall(r"(?s)```\{toctree\}\n(.*?)```", page.read_text(encoding="utf-8")):
            lines = [line.strip() for line in listed.splitlines() if line.strip() and not line.startswith(":")]
            named |= {(page.parent / line).resolve().relative_to(DOCS) for line in lines}
    pages = {page.relative_to(DOCS).with_suffix("") for page in DOCS.rglob("*.md")}
    assert pages - named == {Path("index")}


def prose(page):
    """The sentences of a page, without code, tables, headings, formulae and the addresses of links."""
    text = FENCE.sub("\n\n", page.read_text(encoding="utf-8"))
    text = re.sub(r"<!--.*?-->|\$\$.*?\$\$", "", text, flags=re.DOTALL)
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", text)
    text = re.sub(r"\]\([^)]*\)", "]", text)
    text = re.sub(r"`[^`\n]*`|\$[^$\n]+\$", "x", text)
    lines = [line for line in text.splitlines() if not re.match(r"\s*(#|\||Source:|\(.*\)=$)", line)]
    text = re.sub(r"(?m)^\s*([-*]|\d+\.|:)\s+", "\n\n", "\n".join(lines))
    paragraphs = [" ".join(part.split()) for part in re.split(r"\n\s*\n", text)]
    sentences = [sentence for part in paragraphs for sentence in re.split(r"(?<=[.!?:;])\s+", part)]
    return [sentence for sentence in sentences if len(re.findall(r"\w+", sentence)) > 1]


@pytest.mark.parametrize(
    "page", [page for page in [*PAGES, *EVIDENCE] if prose(page)], ids=lambda page: str(page.relative_to(ROOT))
)
def test_sentences_are_short(page):
    sentences = prose(page)
    mean = sum(len(sentence.split()) for sentence in sentences) / len(sentences)
    longest = max(sentences, key=lambda sentence: len(sentence.split()))
    assert mean < 18, longest
    assert len(longest.split()) <= 25 or page in EVIDENCE, longest


#: Private words, each with the standard one beside it; those of everyday English that also have a plain use are left out.
PRIVATE = {
    "belt": "drive",
    "rub": "slip",
    "rubs": "slips",
    "bear": "carry",
    "bears": "carries",
    "trail": "event sequence",
    "border": "boundary",
    "bend": "curvature",
    "grip": "complementarity",
    "settle": "contact state",
    "foretell": "predict",
    "sharpen": "refine",
    "sharpened": "refined",
    "way down": "descent",
    "laid over": "compared",
    "lay over": "compare",
    "rivals": "alternatives",
    "pulls": "influence",
    "worth": "influence",
    "judges": "checks",
    "judged": "checked",
    "sightings": "detections",
    "habits": "linking",
    "likeness": "response map",
    "contradictions": "consistency check",
    "gauge": "instrument",
    "gauges": "instruments",
    "told": "read",
    "says": "states",
    "asks": "requests",
    "asked": "requested",
    "back-and-forth": "reversing slip",
    "leave map": "release map",
}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_words_are_those_of_the_field(page):
    text = " ".join(prose(page)).lower()
    found = {word: better for word, better in PRIVATE.items() if re.search(rf"\b{word}\b", text)}
    assert not found, found


def test_formulae_have_the_primes_signs_and_spaces_of_tex(monkeypatch):
    pytest.importorskip("latex2mathml")
    monkeypatch.syspath_prepend(DOCS / "extensions")
    from mathml import mathml

    assert '<mi>F</mi><mo lspace="0" rspace="0">&#x02032;</mo>' in mathml(
        "F'(s)"
    )  # no exponent: it would be raised twice
    assert '<mo>&#x0003D;</mo><mo form="prefix">&#x02212;</mo>' in mathml("D = -F")
    assert "<mo>&#x02212;</mo>" in mathml("a - b")
    assert 'rspace="0.17em">ln</mo><mn>10</mn>' in mathml(r"a \ln 10")
    assert "<mi>ln</mi><mo" in mathml(r"\ln(1 + t)")
    assert "<mi>&#x0221E;</mi>" in mathml(r"-\infty")


def test_what_a_function_returns_is_text_and_no_name_of_a_type(monkeypatch):
    napoleon = pytest.importorskip("sphinx.ext.napoleon")
    monkeypatch.syspath_prepend(DOCS / "extensions")
    import docstrings

    lines = ["Do.", "", "Parameters", "----------", "x : a number.", "", "Returns", "-------"]
    lines += ["x, v : arrays (numbers", "for a number): two.", "", "Limits: none."]
    docstrings._prepare(None, "function", "f", None, None, lines)
    text = str(napoleon.NumpyDocstring(lines, napoleon.Config(napoleon_use_rtype=False)))
    assert ":returns: x, v : arrays (numbers\n          for a number): two.\n" in text
    assert ":param x:" in text
    assert "Limits: none." in text.partition(":returns:")[2]
