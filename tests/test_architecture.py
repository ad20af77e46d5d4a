"""The modules of the package import one way: no circle, only the stated arrows; no crowded folder, no vague name."""

import ast
import re
from collections import Counter
from graphlib import TopologicalSorter
from pathlib import Path

from evidence import FOLDER, script

architecture = script("architecture")

#: Circles that are left. The list may only become shorter.
LEFT: list[set[str]] = []
#: Folders with more than a dozen modules, and with how many; the numbers may only fall. `laws` is the catalogue, one law a
#: file, and `cli` has one sub-command a file: these two may grow.
CROWDED = {"laws": 100, "cli": 19}
#: Names that two rooms give to a file each; the list may only become shorter. Files of `cli`, `show` and the paper's figures
#: are named after what they run or draw.
SHARED = {"batch", "calibration", "motion", "parameters", "result", "synthetic"}
#: Private words that no name may hold, each with the standard one beside it.
PRIVATE = {
    "arc": "phase", "arcs": "phases", "bears": "static_limit", "belt": "drive", "bend": "corner", "border": "boundary",
    "borders": "boundaries", "foretell": "predict", "gauge": "instrument", "grip": "complementarity",
    "habits": "linking", "likeness": "response", "onward": "restart", "place": "position", "places": "positions",
    "pulls": "scores", "rivals": "alternatives", "rub": "force_line", "rubs": "force_lines",
    "sharpen": "refine", "sharpened": "refined", "sightings": "detections", "told": "notify", "trail": "event_sequence",
    "wants": "required", "worth": "weight",
}  # fmt: skip
VAGUE = {"utils", "util", "common", "helpers", "helper", "misc", "manager", "tools"}


def test_no_module_imports_itself_through_others():
    assert [circle for circle in architecture.circles() if circle not in LEFT] == []


def test_rooms_import_only_along_the_stated_arrows():
    found = architecture.arrows()
    assert set(found) == set(architecture.ARROWS)
    assert {room: extra for room, others in found.items() if (extra := others - architecture.ARROWS[room])} == {}


def test_the_stated_arrows_point_one_way():
    assert set(TopologicalSorter(architecture.ARROWS).static_order()) == set(architecture.ARROWS)


def test_a_circle_is_seen(tmp_path, monkeypatch):
    (tmp_path / "rooms").mkdir()
    (tmp_path / "rooms" / "a.py").write_text("def f():\n    from stickslip.rooms.b import g\n")
    (tmp_path / "rooms" / "b.py").write_text("from stickslip.rooms import c\n")
    (tmp_path / "rooms" / "c.py").write_text("import stickslip.rooms.a\nfrom stickslip.rooms.d import x\n")
    (tmp_path / "rooms" / "d.py").write_text("if TYPE_CHECKING:\n    from stickslip.rooms.c import C\n")
    monkeypatch.setattr(architecture, "PACKAGE", tmp_path.rename(tmp_path.with_name("stickslip")))
    assert architecture.circles() == [{"stickslip.rooms.a", "stickslip.rooms.b", "stickslip.rooms.c"}]


def test_no_folder_is_crowded():
    files = [path for path in architecture.modules().values() if path.name != "__init__.py"]
    sizes = Counter(path.parent.name for path in files if path.parent != architecture.PACKAGE)
    assert {room: size for room, size in sizes.items() if size > CROWDED.get(room, 12)} == {}


def test_no_file_has_a_vague_name():
    assert [str(path) for path in architecture.modules().values() if path.stem in VAGUE] == []


def test_no_two_files_have_one_name_for_two_ideas():
    files = [path for path in architecture.modules().values() if path.name != "__init__.py"]
    named = Counter(path.stem for path in files if path.parent.name not in ("cli", "show", "figures"))
    assert {name for name, count in named.items() if count > 1} <= SHARED


def _names(path: Path) -> set[str]:
    """The names that a Python or a Rust file gives to things."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".rs":
        text = re.sub(r"//.*", "", text)
        found = re.findall(r"\b(?:fn|struct|enum|trait|mod|let|let mut|type|const)\s+(\w+)|\b(\w+)\s*:(?!:)", text)
        return {name for pair in found for name in pair}
    names = set()
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.arg(arg=name):
                names.add(name)
            case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()):
                names.add(name)
    return names


def test_names_are_words_of_the_field():
    files = [*architecture.modules().values(), *(FOLDER.parents[1] / "crates").glob("stickslip*/src/**/*.rs")]
    found = {}
    for path in files:
        words = {word for name in _names(path) for word in re.split(r"_|(?<=[a-z])(?=[A-Z])", name)}
        if private := {word: PRIVATE[word.lower()] for word in words if word.lower() in PRIVATE}:
            found[str(path.relative_to(FOLDER.parents[1]))] = private
    assert found == {}


def test_the_picture_is_current():
    assert architecture.picture() == architecture.PICTURE.read_text(encoding="utf-8"), (
        "run python docs/evidence/architecture.py"
    )
