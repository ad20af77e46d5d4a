"""Pictures of several panels get the class ``wide``: a phone shows them at a readable size, see static/site.css."""

import re
import struct
from pathlib import Path

from docutils import nodes

PANELS = 5.4
"""Inches from which a picture has several panels."""
DOTS = {".png": 130, ".svg": 72}
"""Pixels or points per inch."""


def _mark(app, document):
    for image in document.findall(nodes.image):
        path = Path(app.srcdir, image["uri"])
        if _width(path) > PANELS * DOTS.get(path.suffix, 1):
            image["classes"].append("wide")


def _width(path):
    if path.suffix == ".png":
        return struct.unpack(">I", path.read_bytes()[16:20])[0]
    found = re.search(r'<svg[^>]*\bwidth="([\d.]+)pt"', path.read_text("utf-8")) if path.suffix == ".svg" else None
    return float(found[1]) if found else 0.0


def setup(app):
    """Run once the places of the pictures are known."""
    app.connect("doctree-read", _mark)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
