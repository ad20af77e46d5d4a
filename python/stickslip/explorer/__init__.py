"""The explorer: one page in which a law is moved by hand and every motion follows, on the same core in any browser.

``explorer.js`` and ``core.wasm.lzma`` are built from ``web/`` and ``crates/stickslip-wasm`` by ``make explorer`` and kept here.
"""

from stickslip.explorer.page import page as page
from stickslip.explorer.page import state_of as state_of

__all__ = ["page", "state_of"]
