"""Readers whose libraries can crash, hang or ask for all memory, in a process of their own that may end.

The process is started by the first such file and serves the next ones too: a file costs some milliseconds more than in the
process that asks. What it sends back is made of plain values and NumPy arrays.
"""

from __future__ import annotations

import atexit
import contextlib
import importlib
import os
import pickle
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import IO, Any

from stickslip.errors import InputError

PATIENCE = 60.0
"""Seconds for a file, and one more for every `RATE` bytes: a whole one takes milliseconds, the start of the process more."""
RATE = 5_000_000
MEMORY = 1 << 30
"""Bytes that reading a file may take, and `EXPANSION` times what it has, as files are compressed."""
EXPANSION = 100

_lock = threading.Lock()
_child: subprocess.Popen[bytes] | None = None
_owner = 0


def memory_for(path: Path) -> int:
    """Bytes that the contents of a file may take."""
    return MEMORY + EXPANSION * path.stat().st_size


def read_apart(reader: str, path: Path, what: str) -> Any:
    """What the function `reader` ("module:function", with the path as its argument) returns, called in the other process.

    Raises
    ------
    InputError
        where it raises anything, ends the process, or takes longer or more memory than such a file needs; `what` says in
        the sentence what the file should be.
    """
    with _lock:
        child = _started()
        limit, begun = PATIENCE + path.stat().st_size / RATE, time.monotonic()
        timer = threading.Timer(limit, child.kill)
        timer.start()
        try:
            # The other process may be in another folder.
            _send(child.stdin, pickle.dumps((reader, path.absolute(), path, what)))
            refused, value = _receive(child.stdout)
        except (OSError, EOFError):
            _stop()
            late = time.monotonic() - begun >= limit
            reason = f"not read within {limit:.0f} s" if late else "it ends the process that reads it"
            raise InputError(damaged(path, what, reason)) from None
        except BaseException:  # interrupted in the middle: the answer must not be taken for that of the next file
            _stop()
            raise
        finally:
            timer.cancel()
    if refused:
        raise InputError(value)
    return value


def damaged(path: Path, what: str, reason: object) -> str:
    """The sentence for a file that is not what it should be."""
    said = str(reason).strip().splitlines() or [type(reason).__name__]
    return f"{path}: not a {what}, or a truncated or damaged one ({said[0]}); make or copy it again"


def _started() -> subprocess.Popen[bytes]:
    global _child, _owner
    if _child is not None and _owner == os.getpid() and _child.poll() is None:
        return _child
    # A library that makes its threads beforehand would take the memory of many files.
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    start = "import sys; sys.path[:] = sys.argv[1:]; from stickslip.files.child_process import serve; serve()"
    _child = subprocess.Popen(
        [sys.executable, "-c", start, *sys.path],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=environment,
        start_new_session=True,  # Ctrl-C is for the process that asks
    )
    _owner = os.getpid()
    return _child


@atexit.register
def _stop() -> None:
    global _child
    if _child is not None and _owner == os.getpid():
        _child.kill()
        _child.wait()
        for pipe in (_child.stdin, _child.stdout):
            with contextlib.suppress(OSError):
                pipe.close()  # type: ignore[union-attr]  # both are pipes
    _child = None


def serve() -> None:
    """Read one file after the other, until nobody asks any more."""
    asked = sys.stdin.buffer
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints is no answer
    while True:
        try:
            reader, file, path, what = _receive(asked)
        except EOFError:
            return
        try:
            _limit(3 * memory_for(file))  # the numbers, a copy of them on their way, and what the library needs
            module, _, function = reader.partition(":")
            answer = (False, getattr(importlib.import_module(module), function)(file))
            data = pickle.dumps(answer, protocol=5)
        except InputError as error:
            data = pickle.dumps((True, str(error)))
        except MemoryError:
            data = pickle.dumps((True, damaged(path, what, "it asks for more memory than such a file needs")))
        except Exception as error:  # noqa: BLE001 the libraries raise some ten types on damaged bytes
            data = pickle.dumps((True, damaged(path, what, error)))
        _send(answers, data)


def _limit(memory: int) -> None:
    """Let this process take so many bytes more than it has, where the system can refuse them."""
    if not sys.platform.startswith("linux"):
        return
    import resource

    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    most = resource.getrlimit(resource.RLIMIT_AS)[1]
    wanted = pages * resource.getpagesize() + memory
    resource.setrlimit(resource.RLIMIT_AS, (wanted if most < 0 else min(wanted, most), most))
    resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))


def _send(pipe: IO[bytes] | None, data: bytes) -> None:
    assert pipe is not None
    pipe.write(struct.pack("<Q", len(data)) + data)
    pipe.flush()


def _receive(pipe: IO[bytes] | None) -> Any:
    assert pipe is not None
    head = pipe.read(8)
    size = struct.unpack("<Q", head)[0] if len(head) == 8 else 0
    data = pipe.read(size)
    if not size or len(data) < size:
        raise EOFError
    return pickle.loads(data)
