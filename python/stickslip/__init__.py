"""stickslip: from a record of something that rubs to a friction law with its uncertainty, and from the law to every motion.

>>> import stickslip as ss
>>> orbit = ss.simulate(ss.paper.oscillator(0.30), t_end=200)
>>> orbit.regime()
'almost_harmonic'
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stickslip import laws, measurement, paper, show, stability
    from stickslip.analysis import basins, leave_map, orbit_diagram, regime_map, return_map, section
    from stickslip.batch import simulate_many
    from stickslip.drive import Drive, Harmonic
    from stickslip.errors import InputError
    from stickslip.identification import identify
    from stickslip.integration import integrate
    from stickslip.law import force_along, load_law
    from stickslip.measurement import measure
    from stickslip.orbit import Orbit, load
    from stickslip.scaling import Scale, dimensionless
    from stickslip.simulation import simulate
    from stickslip.stability.branches import continuation
    from stickslip.stability.critical import critical_velocities
    from stickslip.stability.cycles import periodic_orbit
    from stickslip.stability.exponents import lyapunov
    from stickslip.stability.loci import locus
    from stickslip.stability.switching import switch_branch
    from stickslip.system import Contact, Force, Oscillator, System, chain, load_system
    from stickslip.tracking import film, track

# Where each public name lives; it is imported when it is first asked for, so that `import stickslip` costs nothing.
_HOME = {
    "Contact": "system",
    "Drive": "drive",
    "Force": "system",
    "Harmonic": "drive",
    "InputError": "errors",
    "Orbit": "orbit",
    "Oscillator": "system",
    "Scale": "scaling",
    "System": "system",
    "basins": "analysis",
    "chain": "system",
    "continuation": "stability.branches",
    "critical_velocities": "stability.critical",
    "locus": "stability.loci",
    "switch_branch": "stability.switching",
    "dimensionless": "scaling",
    "force_along": "law",
    "identify": "identification",
    "integrate": "integration",
    "laws": "",
    "leave_map": "analysis",
    "load": "orbit",
    "load_law": "law",
    "load_system": "system",
    "lyapunov": "stability.exponents",
    "measure": "measurement",
    "measurement": "",
    "orbit_diagram": "analysis",
    "paper": "",
    "periodic_orbit": "stability.cycles",
    "regime_map": "analysis",
    "return_map": "analysis",
    "section": "analysis",
    "film": "tracking",
    "show": "",
    "simulate": "simulation",
    "simulate_many": "batch",
    "stability": "",
    "track": "tracking",
}

__all__ = [
    "Contact",
    "Drive",
    "Force",
    "Harmonic",
    "InputError",
    "Orbit",
    "Oscillator",
    "Scale",
    "System",
    "basins",
    "chain",
    "continuation",
    "critical_velocities",
    "dimensionless",
    "film",
    "force_along",
    "identify",
    "integrate",
    "laws",
    "leave_map",
    "load",
    "load_law",
    "load_system",
    "locus",
    "lyapunov",
    "measure",
    "measurement",
    "orbit_diagram",
    "paper",
    "periodic_orbit",
    "regime_map",
    "return_map",
    "section",
    "show",
    "simulate",
    "simulate_many",
    "stability",
    "switch_branch",
    "track",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from stickslip import _core

        return _core.__version__
    if name not in _HOME:
        raise AttributeError(f"module 'stickslip' has no attribute {name!r}")
    home = _HOME[name]
    module = importlib.import_module(f"stickslip.{home or name}")
    value = getattr(module, name) if home else module
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
