"""Run every benchmark and say on what."""

import platform
from importlib.metadata import version

import belt_oscillator

if __name__ == "__main__":
    packages = ", ".join(f"{name} {version(name)}" for name in ("stickslip", "scipy", "numpy"))
    print(f"{platform.machine()}, Python {platform.python_version()}, {packages}\n")
    belt_oscillator.main()
