"""People whose law of motion is known, to test estimators and predictors against.

Imported by tests, demo, docs and benchmarks only; no estimator knows of it.
"""

from human.simulate.box_handling import simulate_box_handling
from human.simulate.box_plan import DEFAULT_STATIONS, Station
from human.simulate.errors import SimulationError
from human.simulate.gait import Cadence
from human.simulate.ground import Dynamics, solve_dynamics
from human.simulate.imus import (
    IMU_SEGMENTS,
    ImuMount,
    ImuNoise,
    ImuReading,
    imu_mounts,
    simulate_imus,
)
from human.simulate.markers import MarkerNoise, simulate_markers, wear_markers
from human.simulate.operators import OPERATOR_KINDS, Comfort, Operator, operator
from human.simulate.paths import (
    MinimumJerkPath,
    PosePath,
    PoseSamples,
    SplinePath,
    minimum_jerk,
    minimum_jerk_path,
    spline_path,
)
from human.simulate.planar import (
    MOBILITY_RANGE,
    PlanarArm,
    PlanarComfort,
    PlanarDemonstrations,
    PlanarLaw,
    planar_law,
    simulate_planar,
)
from human.simulate.plates import Plate, PlateReading, PlateRecording, plate_pair, simulate_plates
from human.simulate.postures import Posture, simulate_postures
from human.simulate.reaching import (
    simulate_following,
    simulate_reaching,
    standing_configuration,
)
from human.simulate.records import SimulatedMotion, Truth
from human.simulate.robot_scene import RobotScene, RobotTrajectory, robot_trajectories
from human.simulate.sensor_noise import Dropouts, SensorNoise
from human.simulate.shoes import ShoeReading, ShoeSensor, shoe_sensors, simulate_shoes
from human.simulate.stance import Stance
from human.simulate.still import simulate_still
from human.simulate.walking import simulate_walking

__all__ = [
    "DEFAULT_STATIONS",
    "IMU_SEGMENTS",
    "MOBILITY_RANGE",
    "OPERATOR_KINDS",
    "Cadence",
    "Comfort",
    "Dropouts",
    "Dynamics",
    "ImuMount",
    "ImuNoise",
    "ImuReading",
    "MarkerNoise",
    "MinimumJerkPath",
    "Operator",
    "PlanarArm",
    "PlanarComfort",
    "PlanarDemonstrations",
    "PlanarLaw",
    "Plate",
    "PlateReading",
    "PlateRecording",
    "PosePath",
    "PoseSamples",
    "Posture",
    "RobotScene",
    "RobotTrajectory",
    "SensorNoise",
    "ShoeReading",
    "ShoeSensor",
    "SimulatedMotion",
    "SimulationError",
    "SplinePath",
    "Stance",
    "Station",
    "Truth",
    "imu_mounts",
    "minimum_jerk",
    "minimum_jerk_path",
    "operator",
    "planar_law",
    "plate_pair",
    "robot_trajectories",
    "shoe_sensors",
    "simulate_box_handling",
    "simulate_following",
    "simulate_imus",
    "simulate_markers",
    "simulate_planar",
    "simulate_plates",
    "simulate_postures",
    "simulate_reaching",
    "simulate_shoes",
    "simulate_still",
    "simulate_walking",
    "solve_dynamics",
    "spline_path",
    "standing_configuration",
    "wear_markers",
]
