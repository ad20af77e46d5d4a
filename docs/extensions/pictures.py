"""Pictures of several panels get the class ``wide``: a phone shows them at a readable size, see static/site.css."""

import struct
from pathlib import Path

from docutils import nodes

PANELS = 700
"""Pixels from which a picture has several panels."""


def _mark(app, document):
    for image in document.findall(nodes.image):
        path = Path(app.srcdir, image["uri"])
        if path.suffix == ".png":
            (width,) = struct.unpack(">I", path.read_bytes()[16:20])
            if width > PANELS:
                image["classes"].append("wide")


def setup(app):
    """Run once the places of the pictures are known."""
    app.connect("doctree-read", _mark)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
