"""iDynTree's MAP solver on the same person, readings and covariances; for comparison alone.

``pip install idyntree`` brings it; nothing else of Ergocast needs it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from estimation import Accelerometer
from human import HumanModel, to_urdf

ACCELEROMETER, NET_WRENCH, JOINT_ACCELERATION = "accelerometer", "wrench", "joint"
MOMENTUM = "momentum"


class PeerMissingError(Exception):
    """iDynTree is not installed."""


@dataclass(frozen=True)
class PeerCovariances:
    """Variances of priors, model equations and sensors, as iDynTree takes them: diagonal."""

    prior: float
    model: float
    accelerometer: float
    joint: float
    wrench: dict[str, np.ndarray]
    untouched: float
    momentum: float = 1e-3


class Peer:
    """One iDynTree problem: made once, then solved frame by frame."""

    def __init__(
        self,
        model: HumanModel,
        accelerometers: list[Accelerometer],
        covariances: PeerCovariances,
        *,
        balance_only: bool = False,
    ) -> None:
        """Loads the model, puts the accelerometers on it and sets every covariance.

        Args:
            model: the person.
            accelerometers: none where only the balance is wanted.
            covariances: of everything.
            balance_only: external wrenches from the rate of change of momentum alone, the 2021
                paper's first step.
        """
        try:
            import idyntree.bindings as idt
        except ImportError:
            raise PeerMissingError(
                "iDynTree is not installed: `pip install idyntree` in this environment"
            ) from None
        self._idt = idt
        # Kept, because the model it hands out is its own and goes with it.
        self._loader = idt.ModelLoader()
        if not self._loader.loadModelFromString(to_urdf(model)):
            raise RuntimeError("iDynTree does not load the model")
        self.model = self._loader.model()
        for sensor in accelerometers:
            self._add(sensor)
        options = idt.BerdyOptions()
        options.berdyVariant = (
            idt.BERDY_FLOATING_BASE_NON_COLLOCATED_EXT_WRENCHES
            if balance_only
            else idt.BERDY_FLOATING_BASE
        )
        options.includeAllNetExternalWrenchesAsDynamicVariables = True
        options.includeAllNetExternalWrenchesAsSensors = True
        options.includeAllJointAccelerationsAsSensors = not balance_only
        options.includeAllJointTorquesAsSensors = False
        options.includeFixedBaseExternalWrench = False
        self._helper = idt.BerdyHelper()
        if not self._helper.init(self.model, options):
            raise RuntimeError("iDynTree's BerdyHelper does not start")
        self.dofs = [self.model.getJointName(k) for k in range(self.model.getNrOfDOFs())]
        self.unknowns = [
            (unknown.type, unknown.id, unknown.range.offset)
            for unknown in self._helper.getDynamicVariablesOrdering()
        ]
        self.order = self._ordering()
        self._solver = idt.BerdySparseMAPSolver(self._helper)
        self._solver.initialize()
        # Afterwards: it would set them back to one.
        self._set_covariances(covariances)
        self._y = idt.VectorDynSize(self._helper.getNrOfSensorsMeasurements())
        # Other vectors are taken, too, but searched for an end that they have not.
        self._joints = (idt.JointPosDoubleArray(self.model), idt.JointDOFsDoubleArray(self.model))
        self._base = self.model.getLinkIndex("Pelvis")

    def _add(self, sensor: Accelerometer) -> None:
        idt = self._idt
        one = idt.AccelerometerSensor()
        one.setName(f"imu_{sensor.link}")
        one.setParentLink(sensor.link)
        one.setParentLinkIndex(self.model.getLinkIndex(sensor.link))
        rotation = np.eye(3) if sensor.rotation is None else np.asarray(sensor.rotation)
        place = idt.Transform(
            idt.Rotation.FromPython(rotation), idt.Position.FromPython(np.asarray(sensor.position))
        )
        one.setLinkSensorTransform(place)
        self.model.sensors().addSensor(one)

    def _ordering(self) -> list[tuple[str, str, int]]:
        """What each range of y is: kind, name and where it starts."""
        idt, out = self._idt, []
        kinds = {
            idt.ACCELEROMETER_SENSOR: ACCELEROMETER,
            idt.NET_EXT_WRENCH_SENSOR: NET_WRENCH,
            idt.DOF_ACCELERATION_SENSOR: JOINT_ACCELERATION,
            idt.RCM_SENSOR: MOMENTUM,
        }
        for sensor in self._helper.getSensorsOrdering():
            if sensor.type in kinds:
                out.append((kinds[sensor.type], sensor.id, sensor.range.offset))
        return out

    def _set_covariances(self, covariances: PeerCovariances) -> None:
        helper, solver = self._helper, self._solver
        solver.setDynamicsRegularizationPriorCovariance(
            self._diagonal(np.full(helper.getNrOfDynamicVariables(), covariances.prior))
        )
        if helper.getNrOfDynamicEquations():
            solver.setDynamicsConstraintsPriorCovariance(
                self._diagonal(np.full(helper.getNrOfDynamicEquations(), covariances.model))
            )
        noise = np.full(helper.getNrOfSensorsMeasurements(), covariances.untouched)
        for kind, name, start in self.order:
            if kind == ACCELEROMETER:
                noise[start : start + 3] = covariances.accelerometer
            elif kind == JOINT_ACCELERATION:
                noise[start] = covariances.joint
            elif kind == MOMENTUM:
                noise[start : start + 6] = covariances.momentum
            elif name in covariances.wrench:
                noise[start : start + 6] = covariances.wrench[name]
        solver.setMeasurementsPriorCovariance(self._diagonal(noise))

    def _diagonal(self, values: np.ndarray) -> Any:
        out = self._idt.SparseMatrixColMajor()
        out.resize(len(values), len(values))
        for k, value in enumerate(values):
            out.setValue(k, k, float(value))
        return out

    def measurement(self, kinds: dict[tuple[str, str], np.ndarray]) -> np.ndarray:
        """Puts readings, by kind and name, into iDynTree's order; what has none reads zero."""
        y = np.zeros(self._helper.getNrOfSensorsMeasurements())
        for kind, name, start in self.order:
            value = np.atleast_1d(kinds.get((kind, name), np.zeros(1)))
            y[start : start + len(value)] = value
        return y

    def load(self, s: np.ndarray, ds: np.ndarray, omega: np.ndarray, y: np.ndarray) -> None:
        """Copies one frame in; apart from `solve`, so that Python's loops are not timed.

        Args:
            s: joint angles in iDynTree's order, rad.
            ds: their rates.
            omega: the base's angular velocity in its own axes, rad/s.
            y: from `measurement`.
        """
        for vector, values in zip((*self._joints, self._y), (s, ds, y), strict=True):
            for k, value in enumerate(values):
                vector.setVal(k, float(value))
        self._spin = self._idt.Vector3.FromPython(omega)

    def solve(self) -> None:
        """Solves the frame that was loaded."""
        self._solver.updateEstimateInformationFloatingBase(
            self._joints[0], self._joints[1], self._base, self._spin, self._y
        )
        if not self._solver.doEstimate():
            raise RuntimeError("iDynTree does not solve the frame")

    def result(self) -> tuple[dict[str, float], dict[str, np.ndarray]]:
        """Returns torques by degree of freedom (N m), and external wrenches by link."""
        last = self._solver.getLastEstimate().toNumPy()
        torques = {
            name: float(last[start + 3 + "xyz".index(name[-1])])
            for kind, name, start in self.unknowns
            if kind == self._idt.JOINT_WRENCH
        }
        wrenches = {
            name: last[start : start + 6].copy()
            for kind, name, start in self.unknowns
            if kind == self._idt.NET_EXT_WRENCH
        }
        return torques, wrenches
