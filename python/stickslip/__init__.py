"""stickslip: from a record of friction to a friction law with its uncertainty, and from the law to every motion.

>>> import stickslip as ss
>>> orbit = ss.simulate(ss.paper.oscillator(0.30), t_end=200)
>>> orbit.regime()
'almost_harmonic'
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stickslip import laws, measurement, paper, show
    from stickslip.dynamics import basins, orbit_diagram, regime_map, release_map, return_map, section
    from stickslip.dynamics.continuation.branch_switching import switch_branch
    from stickslip.dynamics.continuation.branches import continuation
    from stickslip.dynamics.continuation.loci import locus
    from stickslip.dynamics.critical.critical_velocities import critical_velocities
    from stickslip.dynamics.critical.intervals import critical_intervals
    from stickslip.dynamics.periodic.close_returns import periodic_orbits
    from stickslip.dynamics.periodic.derivatives import sensitivities
    from stickslip.dynamics.periodic.lyapunov_exponents import lyapunov
    from stickslip.dynamics.periodic.manifold import manifold
    from stickslip.dynamics.periodic.periodic_orbits import periodic_orbit
    from stickslip.errors import InputError
    from stickslip.experiment.unattended_run import run
    from stickslip.identification import identify
    from stickslip.laws.law import force_along, load_law
    from stickslip.measurement import measure
    from stickslip.model.drive import Drive, Harmonic, NormalForce
    from stickslip.model.scaling import Scale, dimensionless
    from stickslip.model.system import Contact, Force, Oscillator, Spring, System, chain
    from stickslip.model.system_file import load_system
    from stickslip.simulation.batch import simulate_many
    from stickslip.simulation.integration import integrate
    from stickslip.simulation.orbit import Orbit, load
    from stickslip.simulation.simulate import simulate
    from stickslip.tracking import film, track

    __version__: str

# Where each public name lives; it is imported when it is first asked for, so that `import stickslip` costs nothing.
_HOME = {
    "Contact": "model.system",
    "Drive": "model.drive",
    "Force": "model.system",
    "Harmonic": "model.drive",
    "NormalForce": "model.drive",
    "InputError": "errors",
    "Orbit": "simulation.orbit",
    "Oscillator": "model.system",
    "Scale": "model.scaling",
    "Spring": "model.system",
    "System": "model.system",
    "basins": "dynamics",
    "chain": "model.system",
    "continuation": "dynamics.continuation.branches",
    "critical_intervals": "dynamics.critical.intervals",
    "critical_velocities": "dynamics.critical.critical_velocities",
    "locus": "dynamics.continuation.loci",
    "switch_branch": "dynamics.continuation.branch_switching",
    "dimensionless": "model.scaling",
    "force_along": "laws.law",
    "identify": "identification",
    "integrate": "simulation.integration",
    "laws": "",
    "release_map": "dynamics",
    "load": "simulation.orbit",
    "load_law": "laws.law",
    "load_system": "model.system_file",
    "lyapunov": "dynamics.periodic.lyapunov_exponents",
    "measure": "measurement",
    "measurement": "",
    "orbit_diagram": "dynamics",
    "paper": "",
    "periodic_orbit": "dynamics.periodic.periodic_orbits",
    "periodic_orbits": "dynamics.periodic.close_returns",
    "manifold": "dynamics.periodic.manifold",
    "regime_map": "dynamics",
    "return_map": "dynamics",
    "run": "experiment.unattended_run",
    "section": "dynamics",
    "film": "tracking",
    "show": "",
    "sensitivities": "dynamics.periodic.derivatives",
    "simulate": "simulation.simulate",
    "simulate_many": "simulation.batch",
    "track": "tracking",
}

__all__ = [
    "Contact",
    "Drive",
    "Force",
    "Harmonic",
    "InputError",
    "NormalForce",
    "Orbit",
    "Oscillator",
    "Scale",
    "Spring",
    "System",
    "basins",
    "chain",
    "continuation",
    "critical_intervals",
    "critical_velocities",
    "dimensionless",
    "film",
    "force_along",
    "identify",
    "integrate",
    "laws",
    "load",
    "load_law",
    "load_system",
    "locus",
    "lyapunov",
    "manifold",
    "measure",
    "measurement",
    "orbit_diagram",
    "paper",
    "periodic_orbit",
    "periodic_orbits",
    "regime_map",
    "release_map",
    "return_map",
    "run",
    "section",
    "sensitivities",
    "show",
    "simulate",
    "simulate_many",
    "switch_branch",
    "track",
]


if not TYPE_CHECKING:  # a type checker sees the imports above, and that any other name is an error

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
    return sorted(__all__)
