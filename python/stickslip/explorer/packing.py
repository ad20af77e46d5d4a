"""Pack by LZMA and write bytes as text: what a page holds of them. As a script: python packing.py CORE.wasm CORE.wasm.lzma.

It imports nothing of the package, so that ``make explorer`` can run it before there is one.
"""

import base64
import lzma
import sys
from pathlib import Path


def packed(data: bytes) -> bytes:
    """A ``.lzma`` file with its length, smaller by a third than what browsers unpack themselves.

    >>> lzma.decompress(packed(b"stick " * 100)) == b"stick " * 100
    True
    """
    # Neither instructions nor words are aligned to anything: no bits of the position.
    filters = [
        {"id": lzma.FILTER_LZMA1, "preset": 9 | lzma.PRESET_EXTREME, "dict_size": 1 << 21, "lc": 3, "lp": 0, "pb": 0}
    ]
    made = bytearray(lzma.compress(data, format=lzma.FORMAT_ALONE, filters=filters))
    made[5:13] = len(data).to_bytes(8, "little")  # the length, which liblzma leaves open
    return bytes(made)


def text_of(data: bytes) -> str:
    """Five letters for four bytes (RFC 1924), with a comma for the one letter that could end an element of a page.

    >>> text_of(b"slip")
    'b8KmF'
    """
    return base64.b85encode(data).decode("ascii").replace("<", ",")


if __name__ == "__main__":
    source, target = map(Path, sys.argv[1:])
    sys.stdout.write(f"{target.name} {target.write_bytes(packed(source.read_bytes()))} bytes\n")
