"""People whose law of motion is known, to test estimators and predictors against.

Imported by tests, demo, docs and benchmarks only; no estimator knows of it.
"""

from human.simulate.errors import SimulationError
from human.simulate.planar import (
    MOBILITY_RANGE,
    PlanarArm,
    PlanarComfort,
    PlanarDemonstrations,
    PlanarLaw,
    planar_law,
    simulate_planar,
)

__all__ = [
    "MOBILITY_RANGE",
    "PlanarArm",
    "PlanarComfort",
    "PlanarDemonstrations",
    "PlanarLaw",
    "SimulationError",
    "planar_law",
    "simulate_planar",
]
