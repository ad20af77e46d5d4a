"""A regime map over Dask, with one, two and four workers of one thread each, beside the threads of one process.

A worker is a process: lanes of a register are inside each. Where there are fewer cores than workers, look at the processor
time, which says what the cluster adds to the work; the time on the clock says what it saves.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable

import numpy as np
from problems import PROBLEMS
from regimes import TRANSIENT, WINDOW

import stickslip as ss

BASE = PROBLEMS[-1].system
WORKERS = (1, 2, 4)


def _measured(run: Callable[[], object], processor: Callable[[], float]) -> tuple[float, float]:
    """Seconds on the clock and on a processor."""
    begin, spent = time.perf_counter(), processor()
    run()
    return time.perf_counter() - begin, processor() - spent


def compare(side: int, rounds: int) -> list[str]:
    """The table, as lines, of a map of `side` times `side` points."""
    from distributed import Client, LocalCluster

    over = {
        "forcing.amplitude": np.linspace(0.02, 1.6, side),
        "forcing.frequency": np.linspace(0.3, 2.3, side),
    }
    asked = {"transient": TRANSIENT, "window": WINDOW}
    best: dict[str, tuple[float, float]] = {}

    def keep(name: str, found: tuple[float, float]) -> None:
        known = best.get(name, (np.inf, np.inf))
        best[name] = (min(known[0], found[0]), min(known[1], found[1]))

    alone = ss.regime_map(BASE, over, **asked, workers=1)
    for _ in range(rounds):
        keep(
            "one thread, no cluster",
            _measured(lambda: ss.regime_map(BASE, over, **asked, workers=1), time.process_time),
        )
    for count in WORKERS:
        with (
            LocalCluster(n_workers=count, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
            Client(cluster) as client,
        ):

            def processor(client: Client = client) -> float:
                return time.process_time() + sum(client.run(time.process_time).values())

            def run(address: str = cluster.scheduler_address) -> None:
                assert ss.regime_map(BASE, over, **asked, cluster=address).equals(alone)

            run()  # every worker imports
            for _ in range(rounds):
                keep(f"Dask, {count} workers", _measured(run, processor))
    clock, work = best["one thread, no cluster"]
    lines = [
        f"{side} × {side} points on {os.cpu_count()} cores, bit by bit the same map.",
        "",
        "| | seconds | times faster | seconds of processor | more of them |",
        "|---|---|---|---|---|",
    ]
    for name, (seconds, spent) in best.items():
        lines.append(
            f"| {name} | {seconds:.2f} | {clock / seconds:.2f} | {spent:.2f} | {100 * (spent / work - 1):.0f} % |"
        )
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3, help="rounds, the best of which counts; default 3")
    parser.add_argument("--side", type=int, default=300, help="points along each side of the map; default 300")
    options = parser.parse_args()
    print("\n".join(compare(options.side, options.rounds)))


if __name__ == "__main__":
    main()
