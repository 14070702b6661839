"""The estimator for frames as they come: one frame in, one estimate out."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from threading import Lock
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from estimation.covariances import ModelCovariances
from estimation.errors import MeasurementError, UnknownLinkError
from estimation.estimate_inputs import completed, free_links
from estimation.estimate_record import Estimate, from_results
from estimation.exact_solution import Wanted, numpy_solution
from estimation.kernel import Call, Observations, Results, Tables, doubtful, results, tables
from estimation.map_estimator import chosen_kernel
from estimation.sensors import (
    Accelerometer,
    ForceTorque,
    FreeWrench,
    JointAcceleration,
    Measurement,
)
from estimation.spatial import Array, IntArray
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
    Threads may share an estimator; they take turns. Nothing here waits for a compiler: without a
    kernel (see `compile_kernel`) numpy does the work, at some 10 ms a frame instead of some 0.2.
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
            MeasurementError: a covariance or place has the wrong shape.
            CovarianceError: a covariance is not one, or beyond double precision.
        """
        self._tree, self._spreads = tree, spreads
        self._model = covariances or ModelCovariances()
        self._kernel = chosen_kernel(engine)
        self._count = 0
        #: The kernel lets other threads run while it works in this estimator's memory.
        self._turn = Lock()
        self._observed: Observations = {}
        self._call: Call | None = None
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
            MeasurementError: nothing has the name that is to go; or as when first made, and then
                all stays as it was.
        """
        with self._turn:
            sensors = dict(self._sensors)
            for name, sensor in changes.items():
                if sensor is not None:
                    sensors[name] = _zeroed(sensor, self._tree)
                elif sensors.pop(name, None) is None:
                    raise MeasurementError(
                        f"{name}: expected one of {', '.join(sensors)} to take away"
                    )
            self._plan(sensors)

    @np.errstate(over="ignore", invalid="ignore", divide="ignore")
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
            MeasurementError: a shape does not fit, a number is not finite or too large, a reading
                is missing or has an unknown name.
            CovarianceError: beyond double precision.
        """
        state = self._vector("q", q, BASE_NQ + self._tree.n_dof)
        if abs(float(state[3:7] @ state[3:7]) - 1.0) > 2.0 * _NORM_TOLERANCE:
            raise MeasurementError("q: expected a unit base quaternion xyzw")
        size = BASE_NV + self._tree.n_dof
        velocity = np.zeros(size) if v is None else self._vector("v", v, size)
        acceleration = None if a is None else self._vector("a", a, size)
        with self._turn:
            self._take(readings)
            self._derive(state, velocity, acceleration)
            found = self._solve(state[None], velocity[None])
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
            self._call = Call(self._kernel, tree, plan, 1, self._call)
        self._sensors, self._given, self._assumed = sensors, given, tuple(assumed)
        self._wanted, self._tables, self._observed = wanted, plan, observed
        # Readings stand one after another, in the order of the sensors; what is derived follows.
        widths = [_width(sensor, tree) for sensor in given]
        ends = np.cumsum(widths)
        self._places = [slice(end - size, end) for end, size in zip(ends, widths, strict=True)]
        self._taken = np.zeros(ends[-1] if len(ends) else 0)
        self._read = {
            name: place
            for (name, sensor), place in zip(sensors.items(), self._places, strict=False)
            if not isinstance(sensor, FreeWrench)
        }
        self._rest, self._moves = _rest(plan), _moves(plan, self._places)

    def _vector(self, name: str, given: ArrayLike, size: int) -> Array:
        array = np.asarray(given, dtype=np.float64)
        if array.shape != (size,):
            raise MeasurementError(f"{name}: expected shape ({size},), got {array.shape}")
        if not np.isfinite(array).all():
            raise MeasurementError(f"{name}: expected finite numbers")
        return array

    def _take(self, readings: Mapping[str, ArrayLike]) -> None:
        """Takes a frame's readings, one after another, if all are there and make sense."""
        if readings.keys() != self._read.keys():
            for name in readings.keys() - self._read.keys():
                known = ", ".join(self._read) or "none"
                raise MeasurementError(f"{name}: expected a reading of one of: {known}")
            name = next(name for name in self._read if name not in readings)
            raise MeasurementError(
                f"{name}: expected a reading; if it is gone for good, change({{{name!r}: None}})"
            )
        taken = self._taken
        for name, place in self._read.items():
            array = np.asarray(readings[name], dtype=np.float64)
            if array.shape != (place.stop - place.start,):
                raise MeasurementError(
                    f"{name}: expected shape ({place.stop - place.start},), got {array.shape}"
                )
            taken[place] = array
        if not np.isfinite(taken).all():
            bad = (name for name, at in self._read.items() if not np.isfinite(taken[at]).all())
            raise MeasurementError(f"{next(bad)}: expected finite numbers")

    def _derive(self, q: Array, v: Array, a: Array | None) -> None:
        """Puts in what `completed` takes from the motion."""
        first = len(self._sensors)
        if len(self._given) == first:
            return
        if a is None:
            raise MeasurementError(f"a: expected accelerations; {'; '.join(self._assumed)}")
        rotation = quaternion_to_matrix(q[None, 3:BASE_NQ])
        base = proper_acceleration(rotation, v[None], a[None])[0]
        for sensor, place in zip(self._given[first:], self._places[first:], strict=True):
            if isinstance(sensor, JointAcceleration):
                self._taken[place] = a[BASE_NV:]
            else:
                self._taken[place] = base[:3] if isinstance(sensor, Accelerometer) else base[3:]

    def _solve(self, q: Array, v: Array) -> Results:
        call, moves = self._call, self._moves
        if call is not None:
            call.state(q, v)
            row = call.row[0, self._tables.state_width :]
            row[:] = self._rest
            row[moves.columns] += self._taken[moves.sources]
            for source, column, gain in moves.others:
                value = self._taken[source]
                value = gain @ value if gain.ndim == 2 else gain * value
                row[column : column + len(value)] += value
            out = results(self._tree, 1, len(self._wanted.sites), self._spreads)
            call.run(out, 0, 1)
            if not len(doubtful(out.pop("status"))):
                return out
        sensors = [
            sensor
            if isinstance(sensor, FreeWrench)
            else replace(sensor, value=self._taken[place][None])
            for sensor, place in zip(self._given, self._places, strict=True)
        ]
        number = np.array([self._count])
        return numpy_solution(self._wanted, tree_kinematics(self._tree, q, v), sensors, number)


@dataclass(frozen=True, slots=True)
class _Moves:
    """How readings come into the row of a frame: most as they are, all at once."""

    columns: IntArray
    sources: IntArray
    others: tuple[tuple[slice, int, Array], ...]


def _moves(plan: Tables, places: list[slice]) -> _Moves:
    columns: list[int] = []
    sources: list[int] = []
    others = []
    for reading in plan.readings:
        source, column = places[reading.measurement], reading.column - plan.state_width
        plain = reading.gain is None or bool(np.all(reading.gain == 1.0) and reading.gain.ndim == 2)
        size = source.stop - source.start
        # Several sensors of one link add up; they cannot all be moved in one go.
        if plain and column not in columns:
            columns.extend(range(column, column + size))
            sources.extend(range(source.start, source.stop))
        else:
            gain = np.ones(size) if reading.gain is None else reading.gain[0]
            others.append((source, column, gain))
    return _Moves(np.array(columns, dtype=np.intp), np.array(sources, dtype=np.intp), tuple(others))


def _width(sensor: Measurement, tree: EstimationTree) -> int:
    if isinstance(sensor, FreeWrench):
        return 0
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
    out = np.zeros(plan.width)
    for start, array in zip(plan.starts, plan.by_frame, strict=True):
        out[start : start + array.shape[1]] = array[0]
    return out[plan.state_width :]
