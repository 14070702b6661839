"""The error of the simulator."""

from human.errors import HumanError


class SimulationError(HumanError):
    """A motion cannot be simulated as asked: impossible settings, or a target out of reach."""
