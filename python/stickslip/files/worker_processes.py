"""Processes that work for this one and never outlive it."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.connection import Connection


@contextlib.contextmanager
def worker_processes(count: int | None = None) -> Iterator[ProcessPoolExecutor]:
    """A pool of fresh processes, done with their work at the end of the block; ended at once where the block raises.

    Threads and locks of the libraries for films and files do not survive a fork, so each process is a new one. Each ends too
    when this process is killed, as the pipe between them then closes.

    Parameters
    ----------
    count : processes; default one a core.
    """
    context = multiprocessing.get_context("spawn")
    theirs, ours = context.Pipe(duplex=False)
    pool = ProcessPoolExecutor(count, mp_context=context, initializer=_ends_with, initargs=(theirs,))
    try:
        yield pool
    except BaseException:
        ours.close()
        pool.shutdown(cancel_futures=True)
        raise
    else:
        pool.shutdown()
    finally:
        ours.close()
        theirs.close()


def _ends_with(pipe: Connection) -> None:
    """End this process when the other end of the pipe is closed; Ctrl-C is for the process that has it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def exit_when_closed() -> None:
        with contextlib.suppress(OSError, EOFError):
            pipe.recv()
        os._exit(1)

    threading.Thread(target=exit_when_closed, daemon=True).start()
