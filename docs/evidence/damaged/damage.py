"""Copies of files and documents with pieces changed, lost, doubled or moved."""

from __future__ import annotations

import copy
import math
import random
import struct
from collections.abc import Iterator
from typing import Any

WORDS = [
    *("nan", "inf", "-1", "0", "1e999", "-1e-320", "1" * 5000, "[" * 3000, '"', "'", "=", ",", ";", "\n", "\t", "", "_"),
    *("true", "{}", "\0", "µ", "\ufeff", "1e308", "2026-01-01", "#", "$x$", "..", "0x7fffffff", "9223372036854775808"),
]  # fmt: skip
VALUES: list[Any] = [
    *(None, True, -1, 0, 3, 1e308, -1e308, 5e-324, 1e-300, 1e150, math.nan, math.inf, 10**400, "", "x", "1 m", "nan m", "\0"),
    *(b"x", [], {}, [[]], [None], [1, 2], [1, 2, 3], [[0, 1], [1, 2]], [[0, 1], [1e-300, 2]], [["a"]], {"type": "Coulomb"}),
]  # fmt: skip


def spoil_bytes(data: bytes, rng: random.Random) -> bytes:
    """A copy with one to eight pieces changed, lost, doubled, moved or cut off."""
    spoilt = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8))):
        at = rng.randrange(len(spoilt) + 1)
        end = min(len(spoilt), at + rng.choice((1, 1, 2, 4, 8, 100)))
        match rng.randrange(8):
            case 0 if at < len(spoilt):
                spoilt[at] ^= 1 << rng.randrange(8)
            case 1:
                spoilt[at:end] = rng.randbytes(end - at)
            case 2:
                spoilt[at:end] = rng.choice((b"\0", b"\xff", b"\x7f", b"\x80")) * (end - at)
            case 3:
                del spoilt[at:end]
            case 4:
                spoilt[at:at] = spoilt[at:end]
            case 5:
                word = rng.choice(WORDS).encode()
                spoilt[at : min(end, at + len(word))] = word
            case 6 if rng.random() < 0.3:
                del spoilt[at:]
            case _ if len(spoilt) >= 8:
                at = rng.randrange(len(spoilt) - 7)
                number = rng.choice((0, 1, -1, 2**31 - 1, -(2**31), rng.getrandbits(31), rng.randrange(300)))
                spoilt[at : at + 4] = struct.pack(rng.choice("<>") + "i", number)
    return bytes(spoilt)


def spoil_document(document: Any, rng: random.Random) -> Any:
    """A copy with one to three of its values replaced, scaled, lost or doubled under a new name."""
    document = copy.deepcopy(document)
    for _ in range(rng.choice((1, 1, 2, 3))):
        places = list(_places(document))
        if not places:
            return document
        owner, key = rng.choice(places)
        match rng.randrange(5):
            case 0 | 1:
                owner[key] = copy.deepcopy(rng.choice(VALUES))
            case 2 if isinstance(owner[key], float | int) and abs(owner[key]) < 1e300:
                owner[key] = float(owner[key]) * rng.choice((-1.0, 0.0, 1e-300, 1e-30, 1e30, 1e150, 1e300))
            case 3:
                del owner[key]
            case _ if isinstance(owner, dict):
                owner[f"{key}{rng.choice(('', 's', '_', '.x'))}"] = owner.pop(key)
    return document


def _places(document: Any) -> Iterator[tuple[Any, Any]]:
    items = (
        document.items() if isinstance(document, dict) else enumerate(document) if isinstance(document, list) else ()
    )
    for key, value in list(items):
        yield document, key
        yield from _places(value)
