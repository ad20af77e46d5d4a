"""The import graph of the Python package, read from its source, and docs/evidence/architecture.svg drawn from it.

python docs/evidence/architecture.py
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "python" / "stickslip"
PICTURE = Path(__file__).with_suffix(".svg")
#: The rooms in order, from what knows nothing of the others to what knows them all, and which each may import from.
#: `_core` is the compiled border, `main` the file with the public names.
ARROWS = {
    "_core": set[str](),
    "errors": set[str](),
    "main": {"_core"},
    "files": {"errors"},
    "laws": {"_core", "errors", "files"},
    "measurement": {"_core", "errors", "files"},
    "model": {"_core", "errors", "files", "laws"},
    "simulation": {"_core", "errors", "files", "laws", "model"},
    "show": {"_core", "errors", "laws", "measurement", "model", "simulation"},
    "tracking": {"_core", "errors", "files", "show"},
    "dynamics": {"_core", "errors", "files", "laws", "model", "simulation"},
    "examples": {"errors", "model", "simulation"},
    "identification": {"_core", "dynamics", "errors", "files", "laws", "measurement", "model", "show", "simulation"},
    "explorer": {"_core", "errors", "files", "identification", "laws", "model", "simulation"},
    "report": {"_core", "errors", "explorer", "files", "identification", "laws", "measurement", "show"},
    "experiment": {"errors", "files", "identification", "laws", "measurement", "report", "show", "tracking"},
    "paper": {
        *(
            "dynamics",
            "errors",
            "explorer",
            "files",
            "identification",
            "laws",
            "measurement",
            "model",
            "report",
            "show",
        ),
        *("simulation", "tracking"),
    },
    "cli": {
        *(
            "_core",
            "dynamics",
            "errors",
            "examples",
            "experiment",
            "explorer",
            "files",
            "identification",
            "laws",
            "measurement",
            "model",
            "paper",
            "report",
        ),
        *("show", "simulation", "tracking", "explorer"),
    },
    "__main__": {"cli"},
}


def modules() -> dict[str, Path]:
    """Every module of the package by its name; the compiled one by its stub."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py*")):
        if path.suffix in (".py", ".pyi"):
            parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def _run(tree: ast.AST) -> Iterator[ast.Import | ast.ImportFrom]:
    """The imports that are carried out, at once or in a function: all but those for the type checker."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            continue
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node
        yield from _run(node)


def imports() -> dict[str, set[str]]:
    """The modules of the package that each of them imports."""
    return _imports(PACKAGE)


@cache
def _imports(package: Path) -> dict[str, set[str]]:  # noqa: ARG001 - says which package the kept answer is for
    known = modules()
    graph: dict[str, set[str]] = {}
    for name, path in known.items():
        found: set[str] = set()
        for node in _run(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {item.name for item in node.names}
                continue
            # A name is a module of a folder, or stands in the module itself.
            inside = [f"{node.module}.{item.name}" for item in node.names]
            found |= {one if one in known else str(node.module) for one in inside}
        graph[name] = {one for one in found if one in known and one != name}
    return graph


def room_of(module: str) -> str:
    """The folder of the package, or the module itself where it lies at the top."""
    return module.split(".")[1] if "." in module else "main"


def arrows() -> dict[str, set[str]]:
    """The rooms that each room imports from."""
    found: dict[str, set[str]] = {}
    for module, others in imports().items():
        found.setdefault(room_of(module), set()).update({room_of(other) for other in others} - {room_of(module)})
    return found


def circles() -> list[set[str]]:
    """Modules that import each other, directly or through others."""
    graph = imports()

    def reached(start: str) -> set[str]:
        seen, new = set[str](), set(graph[start])
        while new:
            seen |= new
            new = {other for one in new for other in graph[one]} - seen
        return seen

    from_each = {module: reached(module) for module in graph}
    found: list[set[str]] = []
    for module, others in from_each.items():
        circle = {other for other in others if module in from_each[other]}
        if circle and circle not in found:
            found.append(circle)
    return found


def _steps(graph: dict[str, set[str]], room: str) -> set[str]:
    """The arrows of a room that are not also a way through another room: those that are drawn."""

    def below(start: str) -> set[str]:
        return {other for one in graph[start] for other in {one, *below(one)}}

    return {one for one in graph[room] if not any(one in below(other) for other in graph[room] - {one})}


def picture() -> str:
    """The rooms in rows, each above all that it imports from."""
    graph = arrows()
    level: dict[str, int] = {}
    for room in ARROWS:
        level[room] = max((level[other] + 1 for other in graph[room]), default=0)
    count = {room: sum(room_of(module) == room for module in modules()) for room in graph}
    wide, high, top = 180, 34, max(level.values())
    rows = {row: [room for room in ARROWS if level[room] == row] for row in range(top + 1)}
    width = max(len(rooms) for rooms in rows.values()) * (wide + 30) + 30
    place = {}
    for row, rooms in rows.items():
        gap = (width - len(rooms) * wide) / (len(rooms) + 1)
        for i, room in enumerate(rooms):
            place[room] = (gap + i * (gap + wide), 20 + (top - row) * (high + 46))
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {40 + (top + 1) * (high + 46) - 46}" '
        'font-family="sans-serif" font-size="13" text-anchor="middle">',
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0 0 L8 4 L0 8 z" fill="#555"/></marker></defs>',
        '<rect width="100%" height="100%" fill="white"/>',
    ]
    for room in ARROWS:
        for other in sorted(_steps(graph, room)):
            (x, y), (u, v) = place[room], place[other]
            ends = f'x1="{x + wide / 2:.0f}" y1="{y + high:.0f}" x2="{u + wide / 2:.0f}" y2="{v:.0f}"'
            lines.append(f'<line {ends} stroke="#555" marker-end="url(#tip)"/>')
    for room, (x, y) in place.items():
        size = f"{count[room]} modules" if count[room] > 1 else "1 module"
        box = f'x="{x:.0f}" y="{y:.0f}" width="{wide}" height="{high}" rx="4"'
        lines.append(f'<rect {box} fill="#e8f1f8" stroke="#0072b2"/>')
        lines.append(f'<text x="{x + wide / 2:.0f}" y="{y + 21:.0f}">{room} <tspan fill="#777">{size}</tspan></text>')
    return "\n".join([*lines, "</svg>", ""])


if __name__ == "__main__":
    PICTURE.write_text(picture(), encoding="utf-8")
