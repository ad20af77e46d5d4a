"""Hand-written C++ on boost::odeint, compiled here; in quadruple precision it is the reference of all others.

Needs g++ and Boost's headers (Debian: g++, libboost-dev).
"""

from __future__ import annotations

import subprocess
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
from problems import Problem

NAME = "C++, boost::odeint Dormand-Prince 5, events by bisection"
SETTINGS = {"tolerance 1e-6": 1e-6, "tolerance 1e-10": 1e-10}
LONG = 20


@cache
def _program(*flags: str) -> str:
    target = Path(tempfile.mkdtemp(prefix="stickslip-bench-")) / "odeint"
    source = Path(__file__).with_name("odeint.cpp")
    command = ["g++", "-std=gnu++20", "-O3", *flags, str(source), "-o", str(target), "-lquadmath"]
    try:
        subprocess.run(command, check=True, capture_output=True, text=True)
    except FileNotFoundError:
        raise SystemExit("benchmarks: expected the compiler g++; install it (Debian: g++)") from None
    except subprocess.CalledProcessError as error:
        said = error.stderr.splitlines()[0]
        raise SystemExit(
            f"benchmarks: {source.name} was not compiled ({said}); it needs Boost's headers (Debian: libboost-dev)"
        ) from None
    return str(target)


def _call(program: str, *options: str, problem: Problem, end: float, setting: float) -> list[str]:
    numbers = [repr(float(number)) for number in (end, setting, *problem.parameters)]
    return subprocess.run([program, *options, *numbers], check=True, capture_output=True, text=True).stdout.split()


def run(problem: Problem, end: float, tolerance: float) -> np.ndarray:
    return np.array(_call(_program(), problem=problem, end=end, setting=tolerance), dtype=float)


def seconds(problem: Problem, end: float, tolerance: float) -> float:
    """Seconds inside the program."""
    return float(_call(_program(), "--time", problem=problem, end=end, setting=tolerance)[0])


def reference(problem: Problem, end: float, step: float = 0.01) -> np.ndarray:
    """Times of all events in 113 bits: Fehlberg's order eight with a fixed step, good to 1e-19 and more."""
    return np.array(_call(_program("-DQUADRUPLE"), problem=problem, end=end, setting=step), dtype=float)
