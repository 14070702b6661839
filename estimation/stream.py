"""The estimator for frames as they come: one frame in, one estimate out."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from estimation.covariances import ModelCovariances
from estimation.estimate_record import Estimate, from_results
from estimation.exact_solution import Wanted, numpy_solution
from estimation.kernel import Call, Observations, Results, Tables, doubtful, results, tables
from estimation.map_errors import SensorError, UnknownLinkError
from estimation.map_estimator import chosen_kernel
from estimation.run_inputs import completed, free_links
from estimation.sensors import (
    Accelerometer,
    ForceTorque,
    FreeWrench,
    JointAcceleration,
    Measurement,
)
from estimation.spatial import Array
from estimation.tree import BASE_NQ, BASE_NV, EstimationTree
from estimation.tree_kinematics import proper_acceleration, tree_kinematics
from human.rotations import quaternion_to_matrix

_NORM_TOLERANCE = 1e-6
_NO_READINGS: Mapping[str, ArrayLike] = MappingProxyType({})


class Estimator:
    """Estimates a stream in one step, frame by frame; the numbers are those of `estimate`.

    For a recording use `estimate`, which is several times as fast a frame. Sensors, their noise
    and what may be touched can change between any two frames. A frame that makes no sense is
    refused with its reason and leaves no trace: the next one is estimated as if it had not been.
    Nothing here waits for a compiler: without a kernel (see `compile_kernel`) numpy does the work,
    at some 10 ms a frame instead of some 0.2.
    """

    def __init__(
        self,
        tree: EstimationTree,
        measurements: Mapping[str, Measurement],
        *,
        covariances: ModelCovariances | None = None,
        spreads: bool = True,
        engine: Literal["auto", "kernel", "numpy"] = "auto",
    ) -> None:
        """Makes room for a frame.

        Args:
            tree: the links, from `real_tree` or `hinge_tree`.
            measurements: the sensors by names of your choice, each with its covariance and place;
                of their values nothing is read, so ``()`` will do. With them the links that
                something unmeasured may push on, as for `estimate`.
            covariances: of the model.
            spreads: whether to compute standard deviations; half the time.
            engine: as for `estimate`.

        Raises:
            KernelMissingError: the kernel is asked for and has not been compiled.
            UnknownLinkError: a sensor is on a link that the tree has not.
            SensorError: a covariance or place has the wrong shape.
            CovarianceError: a covariance is not one, or beyond double precision.
        """
        self._tree, self._spreads = tree, spreads
        self._model = covariances or ModelCovariances()
        self._kernel = chosen_kernel(engine)
        self._count = 0
        self._observed: Observations = {}
        self._plan({name: _zeroed(sensor, tree) for name, sensor in measurements.items()})

    @property
    def measurements(self) -> Mapping[str, Measurement]:
        """The sensors and free links that the next frame is estimated from."""
        return MappingProxyType(self._sensors)

    @property
    def engine(self) -> Literal["kernel", "numpy"]:
        """What does the arithmetic."""
        return "kernel" if self._wanted.compiled else "numpy"

    @property
    def assumed(self) -> tuple[str, ...]:
        """What is derived instead of measured, in words."""
        return self._assumed

    def change(self, changes: Mapping[str, Measurement | None]) -> None:
        """Changes sensors and free links from the next frame on.

        Args:
            changes: by name: new or changed ones, and None for those that are gone.

        Raises:
            SensorError: nothing has the name that is to go; or as when first made, and then all
                stays as it was.
        """
        sensors = dict(self._sensors)
        for name, sensor in changes.items():
            if sensor is not None:
                sensors[name] = _zeroed(sensor, self._tree)
            elif sensors.pop(name, None) is None:
                raise SensorError(name, f"expected one of {', '.join(sensors)} to take away")
        self._plan(sensors)

    def step(
        self,
        q: ArrayLike,
        v: ArrayLike | None = None,
        readings: Mapping[str, ArrayLike] = _NO_READINGS,
        a: ArrayLike | None = None,
    ) -> Estimate:
        """Estimates one frame.

        Args:
            q: ``(7 + n_dof,)`` base position (m), base quaternion xyzw, joint angles (rad).
            v: ``(6 + n_dof,)`` base twist in body axes, joint rates; None stands for rest.
            readings: of every sensor its value, by the names given.
            a: ``(6 + n_dof,)`` accelerations of the motion; needed where `assumed` says that they
                stand in for what no sensor measures.

        Returns:
            A run of one frame; ``frames`` counts those estimated before.

        Raises:
            SensorError: a shape does not fit, a number is not finite, a reading is missing or has
                an unknown name.
            CovarianceError: beyond double precision.
        """
        state = self._vector("q", q, BASE_NQ + self._tree.n_dof)
        if abs(float(state[3:7] @ state[3:7]) - 1.0) > 2.0 * _NORM_TOLERANCE:
            raise SensorError("q", "expected a unit base quaternion xyzw")
        size = BASE_NV + self._tree.n_dof
        velocity = np.zeros(size) if v is None else self._vector("v", v, size)
        acceleration = None if a is None else self._vector("a", a, size)
        values = self._values(readings)
        values += self._derived(state, velocity, acceleration)
        found = self._solve(state[None], velocity[None], values)
        estimate = from_results(
            found,
            tree=self._tree,
            method="one_step",
            frames=np.array([self._count]),
            left_out={},
            sites=self._wanted.sites,
            bands="uncertainty" if self._spreads else "none",
            assumed=self._assumed,
            engine=self.engine,
        )
        self._count += 1
        return estimate

    def _plan(self, sensors: dict[str, Measurement]) -> None:
        """Prepares for these sensors; sets nothing before all of it is known to work."""
        tree = self._tree
        for sensor in sensors.values():
            if not isinstance(sensor, JointAcceleration) and sensor.link not in tree.link_names:
                raise UnknownLinkError(sensor.link, tree.link_names)
        q, v = np.zeros((1, BASE_NQ + tree.n_dof)), np.zeros((1, BASE_NV + tree.n_dof))
        q[0, 6] = 1.0
        given, assumed = completed(tree, q, v, v, list(sensors.values()), self._model)
        sites = free_links(list(sensors.values()))
        wanted = Wanted(tree, self._model, sites, self._spreads, self._kernel)
        given[len(sensors) :] = [_zeroed(sensor, tree) for sensor in given[len(sensors) :]]
        kept = {id(sensor) for sensor in sensors.values()}
        observed = {key: seen for key, seen in self._observed.items() if key in kept}
        plan = tables(tree, given, self._model, 1, sites, self._spreads, observed)
        if wanted.compiled and self._kernel is not None:
            self._call = Call(self._kernel, tree, plan, 1)
        self._sensors, self._given, self._assumed = sensors, given, tuple(assumed)
        self._wanted, self._tables, self._observed = wanted, plan, observed
        self._rest = _rest(plan)
        #: Sensors that are read, in order; those derived from the motion follow.
        self._read = {
            name: _width(sensor, tree)
            for name, sensor in sensors.items()
            if not isinstance(sensor, FreeWrench)
        }

    def _vector(self, name: str, given: ArrayLike, size: int) -> Array:
        array = np.asarray(given, dtype=np.float64)
        if array.shape != (size,):
            raise SensorError(name, f"expected shape ({size},), got {array.shape}")
        if not np.isfinite(array).all():
            raise SensorError(name, "expected finite numbers")
        return array

    def _values(self, readings: Mapping[str, ArrayLike]) -> list[Array]:
        unknown = readings.keys() - self._read.keys()
        if unknown:
            known = ", ".join(self._read) or "none"
            raise SensorError(sorted(unknown)[0], f"expected a reading of one of: {known}")
        out = []
        for name, size in self._read.items():
            if name not in readings:
                raise SensorError(
                    name, f"expected a reading; if it is gone for good, change({{{name!r}: None}})"
                )
            out.append(self._vector(name, readings[name], size))
        return out

    def _derived(self, q: Array, v: Array, a: Array | None) -> list[Array]:
        """Values of what `completed` added."""
        more = self._given[len(self._sensors) :]
        if not more:
            return []
        if a is None:
            raise SensorError("a", f"expected accelerations; {'; '.join(self._assumed)}")
        rotation = quaternion_to_matrix(q[None, 3:BASE_NQ])
        base = proper_acceleration(rotation, v[None], a[None])[0]
        values = []
        for sensor in more:
            if isinstance(sensor, JointAcceleration):
                values.append(a[BASE_NV:])
            else:
                values.append(base[:3] if isinstance(sensor, Accelerometer) else base[3:])
        return values

    def _solve(self, q: Array, v: Array, values: list[Array]) -> Results:
        if self._wanted.compiled:
            call, count = self._call, len(self._wanted.sites)
            call.state(q, v)
            call.row[0, len(call.row[0]) - len(self._rest) :] = self._rest
            measured = iter(values)
            by_place = [
                None if isinstance(sensor, FreeWrench) else next(measured) for sensor in self._given
            ]
            for reading in self._tables.readings:
                value = by_place[reading.measurement]
                assert value is not None
                if reading.gain is not None:
                    gain = reading.gain[0]
                    value = gain @ value if gain.ndim == 2 else gain * value
                call.row[0, reading.column : reading.column + len(value)] += value
            out = results(self._tree, 1, count, self._spreads)
            call.run(out, 0, 1)
            if not len(doubtful(out.pop("status"))):
                return out
        measured = iter(values)
        sensors = [
            sensor
            if isinstance(sensor, FreeWrench)
            else replace(sensor, value=next(measured)[None])
            for sensor in self._given
        ]
        return numpy_solution(self._wanted, tree_kinematics(self._tree, q, v), sensors, 1)


def _width(sensor: Measurement, tree: EstimationTree) -> int:
    if isinstance(sensor, JointAcceleration):
        return tree.n_dof
    return 6 if isinstance(sensor, ForceTorque) else 3


def _zeroed(sensor: Measurement, tree: EstimationTree) -> Measurement:
    """The sensor with one frame of zeros for a value."""
    if isinstance(sensor, FreeWrench):
        return sensor
    return replace(sensor, value=np.zeros((1, _width(sensor, tree))))


def _rest(plan: Tables) -> Array:
    """What stands in the row of a frame, after the state, beside the readings."""
    out = np.zeros(plan.width - (plan.starts[0] if plan.starts else plan.width))
    for start, array in zip(plan.starts, plan.by_frame, strict=True):
        first = start - plan.starts[0]
        out[first : first + array.shape[1]] = array[0]
    return out
