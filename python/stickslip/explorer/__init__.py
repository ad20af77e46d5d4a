"""The explorer: one page in which a law is moved by hand and every motion follows, on the same core in any browser.

``explorer.js`` and ``core.wasm.lzma`` are built from ``web/`` and ``crates/stickslip-wasm`` by ``make explorer`` and kept
here.
"""

from stickslip.explorer.page import content_of as content_of
from stickslip.explorer.page import page as page

__all__ = ["content_of", "page"]
