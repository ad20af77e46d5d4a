"""Pack the core by LZMA: python pack.py CORE.wasm CORE.wasm.lzma."""

import lzma
import sys
from pathlib import Path

source, target = map(Path, sys.argv[1:])
core = source.read_bytes()
# Instructions are not aligned to anything: no bits of the position.
filters = [
    {"id": lzma.FILTER_LZMA1, "preset": 9 | lzma.PRESET_EXTREME, "dict_size": 1 << 21, "lc": 3, "lp": 0, "pb": 0}
]
packed = bytearray(lzma.compress(core, format=lzma.FORMAT_ALONE, filters=filters))
packed[5:13] = len(core).to_bytes(8, "little")  # the length, which liblzma leaves open
target.write_bytes(packed)
sys.stdout.write(f"{target.name} {len(packed)} bytes\n")
