"""The explorer: one page in which a law is moved by hand and every motion follows, on the same core in any browser.

``explorer.js`` and ``core.wasm.lzma`` are built from ``web/`` and ``crates/stickslip-wasm`` by ``make explorer`` and kept
here.
"""

from stickslip.explorer.page import content_of as content_of
from stickslip.explorer.page import content_of_record as content_of_record
from stickslip.explorer.page import content_of_system as content_of_system
from stickslip.explorer.page import live as live
from stickslip.explorer.page import page as page
from stickslip.explorer.page import program as program

__all__ = ["content_of", "content_of_record", "content_of_system", "live", "page", "program"]
