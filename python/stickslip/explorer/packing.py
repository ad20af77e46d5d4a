"""Pack by LZMA and write bytes as text: what a page holds of them. As a script: python packing.py CORE.wasm CORE.wasm.lzma.

It imports nothing of the package, so that ``make explorer`` can run it before there is one.
"""

import lzma
import sys
from pathlib import Path

LETTERS = [chr(code) for code in range(33, 127) if chr(code) != "<"]
PAIRS = [low + high for high in LETTERS for low in LETTERS]
#: Numbers of 13 bits below this one leave room for one bit more.
LONGER = len(PAIRS) - 8192


def packed(data: bytes) -> bytes:
    """A ``.lzma`` file with its length, smaller by a third than what browsers unpack themselves.

    >>> lzma.decompress(packed(b"stick " * 100)) == b"stick " * 100
    True
    """
    # Neither instructions nor words are aligned to anything: no bits of the position.
    filters = [
        {"id": lzma.FILTER_LZMA1, "preset": 9 | lzma.PRESET_EXTREME, "dict_size": 1 << 21, "lc": 4, "lp": 0, "pb": 0}
    ]
    made = bytearray(lzma.compress(data, format=lzma.FORMAT_ALONE, filters=filters))
    made[5:13] = len(data).to_bytes(8, "little")  # the length, which liblzma leaves open
    return bytes(made)


def text_of(data: bytes) -> str:
    """Two letters for each 13 bits, or 14 where they are a number that two letters can still write: 93 letters, all but "<".

    Bits come lowest first, as in basE91 (J. Henke, 2006); what is read back may have one byte 0 more.

    >>> text_of(b"stick")
    '=Z-muk!'
    """
    text, bits, count = [], 0, 0
    for byte in data:
        bits |= byte << count
        count += 8
        if count > 13:
            taken = 14 if bits & 8191 < LONGER else 13
            text.append(PAIRS[bits & (1 << taken) - 1])
            bits >>= taken
            count -= taken
    return "".join(text) + (PAIRS[bits][: 1 if count < 7 else 2] if count else "")


if __name__ == "__main__":
    source, target = map(Path, sys.argv[1:])
    sys.stdout.write(f"{target.name} {target.write_bytes(packed(source.read_bytes()))} bytes\n")
