"""How wrong a model may be, and what that does to an estimate: bands beyond the sensors' noise."""

from dataclasses import dataclass

from estimation.map_errors import SensorError


@dataclass(frozen=True, slots=True)
class ModelErrors:
    """Standard deviations of errors that stay the same through a run.

    Attributes:
        segment_mass: of each segment's mass, as a share.
        segment_length: of each segment's length, as a share.
        joint_angle_deg: of each joint angle, degrees.
        plate_offset_m: of where each foot's measured force acts, along each horizontal axis, m.
        pairs: how many pairs of opposite draws.
        grid_s: how far apart in time the draws are worked out; between, they are interpolated.

    Raises:
        SensorError: a value makes no sense.
    """

    segment_mass: float = 0.05
    segment_length: float = 0.02
    joint_angle_deg: float = 2.0
    plate_offset_m: float = 0.005
    pairs: int = 12
    grid_s: float = 0.25

    def __post_init__(self) -> None:
        """Refuses what makes no sense."""
        for name, most in (
            ("segment_mass", 0.3),
            ("segment_length", 0.3),
            ("joint_angle_deg", 30.0),
            ("plate_offset_m", 0.5),
        ):
            value = getattr(self, name)
            if not 0.0 <= value <= most:
                raise SensorError(f"model error {name}", f"expected 0 to {most:g}, got {value}")
        if self.pairs < 2 or not self.grid_s > 0.0:
            raise SensorError(
                "model errors",
                f"expected two or more pairs and a grid above 0 s, got {self.pairs}, {self.grid_s}",
            )
