"""Pictures that become alive: an image with the title ``live: #state`` is a live figure on the site, a still one elsewhere.

The panels may follow the state: ``live: #forced law,phase``.
"""

from html import escape

from docutils import nodes
from sphinx.errors import ExtensionError

from stickslip.explorer import program
from stickslip.explorer.page import presets

_MARK = "live: "


def _come_alive(app, doctree, docname):
    if app.builder.format != "html":
        return
    for image in list(doctree.findall(nodes.image)):
        title = image.get("title", "")
        if not title.startswith(_MARK):
            continue
        state, _, panels = title.removeprefix(_MARK).partition(" ")
        name = state.removeprefix("#").partition("&")[0]
        if name not in presets():
            raise ExtensionError(f"{docname}: expected the name of a preset in {title!r}, got {name!r}")
        del image["title"]
        opening = f'<stick-slip address="{escape(state)}" panels="{escape(panels.strip() or "rig,law,phase")}">'
        place = image.parent.index(image)
        image.parent.insert(place + 1, nodes.raw("", "</stick-slip>", format="html"))
        image.parent.insert(place, nodes.raw("", opening, format="html"))


def _add_program(_app, _pagename, _templatename, context, _doctree):
    if "<stick-slip " in context.get("body", ""):
        context["body"] += program()


def setup(app):
    """Register the hook."""
    app.connect("doctree-resolved", _come_alive)
    app.connect("html-page-context", _add_program)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
