"""The modules of the package import one way: no circle, only the stated arrows; no crowded folder, no vague name."""

import importlib.util
from collections import Counter
from graphlib import TopologicalSorter
from pathlib import Path

SCRIPT = Path(__file__).parents[1] / "docs" / "evidence" / "architecture.py"
_spec = importlib.util.spec_from_file_location("architecture", SCRIPT)
architecture = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(architecture)

#: Circles that are left. The list may only become shorter.
LEFT: list[set[str]] = []
#: Folders with more than a dozen modules, and with how many; the numbers may only fall. `laws` is the catalogue, one law a
#: file, and `cli` has one sub-command a file: these two may grow.
CROWDED = {"laws": 100, "cli": 18}
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


def test_the_picture_is_current():
    assert architecture.picture() == architecture.PICTURE.read_text(encoding="utf-8"), f"run python {SCRIPT.name}"
