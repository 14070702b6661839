"""Turns a run's measurements into the kernel's tables: numbers by reference, constant or by frame.

What a link's own sensors say together is what `problem.assemble` says; only what depends on
positions and velocities is left to the kernel.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from estimation.covariances import INFINITE, ModelCovariances
from estimation.kernel.layout import (
    COMMON_SLOTS,
    GLOBAL,
    GLOBAL_SIZE,
    LANES,
    LINK_CONSTANTS,
    LINK_CONSTANTS_SIZE,
    LINK_ROW,
    LINK_ROW_SIZE,
    LINK_SLOTS,
    PAIR_ROW_SIZE,
    PLATE_ROW_SIZE,
    SENSOR_ROW_SIZE,
    SETTING,
    SETTINGS,
    columns,
    output_sizes,
)
from estimation.problem import (
    joint_information,
    model_noise,
    observation,
    untouched,
    wrench_carrier,
)
from estimation.sensors import (
    Accelerometer,
    AngularAcceleration,
    ForceTorque,
    FreeWrench,
    JointAcceleration,
    Measurement,
    blocks,
    checked_blocks,
    describe,
    point,
    turning,
    values,
)
from estimation.sensors import variances as joint_variances
from estimation.spatial import Array, IntArray, inverse, symmetric, times, transposed
from estimation.tree import EstimationTree

#: What was found out about sensors, by their identity; with the sensor, so that it stays its own.
Observations = dict[int, tuple[Measurement, Any]]


@dataclass(frozen=True, slots=True)
class Reading:
    """Where the value of a measurement goes in the row of a frame, and with what gain.

    Attributes:
        measurement: which, in the order given.
        column: where it starts.
        gain: ``(1, n, n)`` matrix or ``(1, n)`` factors; None: the value itself.
    """

    measurement: int
    column: int
    gain: Array | None


@dataclass(frozen=True, slots=True)
class Tables:
    """The kernel's inputs but for the state.

    Attributes:
        constants: numbers that hold for all frames.
        by_frame: ``(frames, ...)`` arrays that stand in the row of each frame, after the state.
        starts: the column where each of those starts.
        width: numbers in the row of a frame.
        state_width: how many of them are the state.
        slots: of working memory.
        links: whole numbers of each link.
        plates: of each force plate.
        motion_sensors: of each accelerometer.
        pairs: of each pair of sites.
        paths: links between sites and where they meet, one after another.
        settings: of the run.
        readings: how a frame's own values add up to what stands in ``by_frame``; of a run whose
            values are zero, what stands there is all the rest.
    """

    constants: Array
    by_frame: tuple[Array, ...]
    starts: tuple[int, ...]
    width: int
    state_width: int
    slots: int
    links: IntArray
    plates: IntArray
    motion_sensors: IntArray
    pairs: IntArray
    paths: IntArray
    settings: IntArray
    readings: tuple[Reading, ...]


class _Numbers:
    """Collects numbers and hands out references to them."""

    def __init__(self, tree: EstimationTree) -> None:
        self.constants: list[Array] = []
        self.count = GLOBAL_SIZE + tree.n_links * LINK_CONSTANTS_SIZE
        self.by_frame: list[Array] = []
        self.starts: list[int] = []
        self.width = columns(tree.n_dof)[1]
        self.readings: list[Reading] = []

    def refer(self, array: Array) -> int:
        """Takes ``(1 or frames, ...)`` numbers: the same for all frames, or each frame's own."""
        flat = array.reshape(len(array), -1)
        return self.same(flat[0]) if len(flat) == 1 else self.own(flat)

    def same(self, flat: Array) -> int:
        """Takes numbers that hold for all frames."""
        self.constants.append(flat.ravel())
        self.count += flat.size
        return self.count - flat.size

    def own(self, flat: Array) -> int:
        """Takes ``(frames, n)`` numbers of each frame."""
        self.by_frame.append(flat)
        self.starts.append(self.width)
        self.width += flat.shape[1]
        return -1 - self.starts[-1]

    def read(self, measurement: int, reference: int, gain: Array | None = None) -> int:
        """Remembers that a measurement's value goes where its frames' own numbers stand."""
        self.readings.append(Reading(measurement, -1 - reference, gain))
        return reference


def tables(
    tree: EstimationTree,
    measurements: Sequence[Measurement],
    covariances: ModelCovariances,
    frames: int,
    sites: Sequence[str],
    spreads: bool,
    remembered: Observations | None = None,
) -> Tables:
    """Makes the tables of a run.

    Args:
        tree: the links.
        measurements: all finite, ``frames`` each, on links of the tree.
        covariances: of the model; not carried over from hinges.
        frames: how many.
        sites: links whose wrenches' covariances are wanted together.
        spreads: whether standard deviations are wanted.
        remembered: what was found out about sensors before; what is new is added.

    Raises:
        MeasurementError: a value or covariance has the wrong shape.
        CovarianceError: a covariance is not one.
        MissingMeasurementError: nobody knows the joint accelerations.
    """
    numbers = _Numbers(tree)
    links = np.zeros((tree.n_links, LINK_ROW_SIZE), dtype=np.int64)
    for link, (axes, dofs) in enumerate(zip(tree.axes, tree.dofs, strict=True)):
        links[link, LINK_ROW["parent"]] = max(0, tree.parents[link])
        links[link, LINK_ROW["axes"]] = len(axes)
        links[link, LINK_ROW["axis"] : LINK_ROW["axis"] + len(axes)] = axes
        links[link, LINK_ROW["dof"] : LINK_ROW["dof"] + len(axes)] = dofs
    memory: Observations = {} if remembered is None else remembered
    sensors = _motion_sensors(tree, measurements, covariances, frames, numbers, links, memory)
    plates = _wrenches(tree, measurements, covariances, frames, numbers, links, memory)
    variance, mean = joint_information(tree, measurements, covariances, frames)
    means = numbers.own(mean)
    for which, sensor in enumerate(measurements):
        if isinstance(sensor, JointAcceleration):
            gain = variance / joint_variances(sensor, frames, tree.n_dof)
            numbers.read(which, means, gain)
    settings = np.zeros(len(SETTINGS), dtype=np.int64)
    pairs, paths = _pairs(tree, sites)
    for name, number in {
        "n_links": tree.n_links,
        "n_dof": tree.n_dof,
        "spreads": int(spreads),
        "prior_on_joint_wrenches": int(covariances.joint_wrench_prior != INFINITE),
        "prior_on_wrenches": int(covariances.wrench_prior != INFINITE),
        "n_sites": len(sites),
        "n_pairs": len(pairs),
        "joint_variance": numbers.refer(variance),
        "joint_mean": means,
    }.items():
        settings[SETTING[name]] = number
    width = -(-numbers.width // LANES) * LANES
    settings[SETTING["width"]] = width
    at = COMMON_SLOTS + tree.n_links * LINK_SLOTS
    settings[SETTING["row_start"]], at = at, at + width
    for name, size in output_sizes(tree.n_links, tree.n_dof, len(sites)).items():
        settings[SETTING[f"size of {name}"]] = size
        settings[SETTING[f"start of {name}"]], at = at, at + size
    constants = np.concatenate([_fixed(tree, covariances), *numbers.constants])
    return Tables(
        constants=constants,
        by_frame=tuple(numbers.by_frame),
        starts=tuple(numbers.starts),
        width=width,
        state_width=columns(tree.n_dof)[1],
        slots=at,
        links=links,
        plates=plates,
        motion_sensors=sensors,
        pairs=pairs,
        paths=paths,
        settings=settings,
        readings=tuple(numbers.readings),
    )


@lru_cache(maxsize=8)
def _fixed(tree: EstimationTree, covariances: ModelCovariances) -> Array:
    """Constants of the model alone."""
    out = np.zeros(GLOBAL_SIZE + tree.n_links * LINK_CONSTANTS_SIZE)
    mean = covariances.prior_mean
    out[GLOBAL["information_mean"]] = mean / covariances.acceleration_prior
    out[GLOBAL["wrench_information"]] = 1.0 / covariances.wrench_prior
    out[GLOBAL["wrench_pull"]] = mean / covariances.wrench_prior
    out[GLOBAL["prior_mean"]] = mean
    if covariances.joint_wrench_prior != INFINITE:
        start = GLOBAL["joint_wrench_prior"]
        out[start : start + 36] = (covariances.joint_wrench_prior * np.eye(6)).ravel()
    dynamics, kinematic, _ = model_noise(tree, covariances)
    rows = out[GLOBAL_SIZE:].reshape(tree.n_links, LINK_CONSTANTS_SIZE)
    for name, block in (
        ("offset", tree.offsets),
        ("inertia", tree.inertias),
        ("dynamics", np.array(dynamics)),
        ("kinematic_inverse", inverse(np.array(kinematic))),
    ):
        flat = block.reshape(tree.n_links, -1)
        start = LINK_CONSTANTS[name]
        rows[:, start : start + flat.shape[1]] = flat
    out.flags.writeable = False
    return out


def _motion_sensors(
    tree: EstimationTree,
    measurements: Sequence[Measurement],
    covariances: ModelCovariances,
    frames: int,
    numbers: _Numbers,
    links: IntArray,
    remembered: Observations,
) -> IntArray:
    """Refers to what accelerometers tell; returns their rows, link by link."""
    prior = np.eye(6)[None] / covariances.acceleration_prior
    J = [prior] * tree.n_links
    rows: list[list[list[int]]] = [[] for _ in tree.link_names]
    nowhere = numbers.same(np.zeros(3))
    for which, sensor in enumerate(measurements):
        if not isinstance(sensor, Accelerometer | AngularAcceleration):
            continue
        link = tree.link_names.index(sensor.link)
        if id(sensor) not in remembered:
            axes, r, C, weighted = observation(sensor, frames)
            spun = weighted if sensor.rotation is None else weighted @ transposed(axes)
            information = symmetric(weighted @ C)
            remembered[id(sensor)] = (sensor, (r, weighted, spun, information))
        r, weighted, spun, information = remembered[id(sensor)][1]
        J[link] = J[link] + information
        rows[link].append(
            [
                numbers.refer(weighted),
                numbers.refer(spun),
                nowhere if r is None else numbers.refer(r),
                numbers.read(which, numbers.own(values(sensor, sensor.value, frames, 3))),
            ]
        )
    plain = numbers.same(prior[0])
    for link, block in enumerate(J):
        own = plain if block is prior else numbers.refer(block)
        links[link, LINK_ROW["information"]] = own
    return _in_turn(rows, links, "first_sensor", "last_sensor", SENSOR_ROW_SIZE)


def _in_turn(
    rows: list[list[list[int]]], links: IntArray, first: str, last: str, size: int
) -> IntArray:
    """Puts the links' rows one after another and tells each link which are its own."""
    ends = np.cumsum([len(own) for own in rows])
    links[:, LINK_ROW[last]] = ends
    links[1:, LINK_ROW[first]] = ends[:-1]
    flat = [row for own in rows for row in own]
    return np.array(flat, dtype=np.int64).reshape(-1, size)


def _wrenches(
    tree: EstimationTree,
    measurements: Sequence[Measurement],
    covariances: ModelCovariances,
    frames: int,
    numbers: _Numbers,
    links: IntArray,
    remembered: Observations,
) -> IntArray:
    """Refers to what force sensors tell; returns the rows of plates, link by link."""
    noise: dict[int, Array] = {}
    summed: dict[int, Array] = {}
    parts: dict[int, list[tuple[int, Array | None]]] = {}
    plates: list[list[list[int]]] = [[] for _ in tree.link_names]
    nothing = np.zeros((1, 6, 6))
    for which, sensor in enumerate(measurements):
        if not isinstance(sensor, ForceTorque | FreeWrench):
            continue
        link = tree.link_names.index(sensor.link)
        if id(sensor) not in remembered:
            remembered[id(sensor)] = (sensor, _wrench_noise(sensor, frames))
        axes, place, carry, block = remembered[id(sensor)][1]
        if isinstance(sensor, FreeWrench):
            noise[link] = noise.get(link, nothing) + block
            continue
        y = values(sensor, sensor.value, frames, 6)
        if sensor.fixed_to == "world":
            noise.setdefault(link, nothing)
            own = [numbers.refer(part) for part in (axes, place, block)]
            plates[link].append([*own, numbers.read(which, numbers.own(y))])
            continue
        y = y if carry is None else times(carry, y)
        noise[link] = noise.get(link, nothing) + block
        summed[link] = summed[link] + y if link in summed else y
        parts.setdefault(link, []).append((which, carry))
    untouched_block = numbers.same(untouched(covariances))
    for link in range(tree.n_links):
        spread = numbers.refer(noise[link]) if link in noise else untouched_block
        links[link, LINK_ROW["wrench_covariance"]] = spread
        mean = numbers.own(summed[link]) if link in summed else GLOBAL["zeros"]
        for which, carry in parts.get(link, ()):
            numbers.read(which, mean, carry)
        links[link, LINK_ROW["wrench"]] = mean
    return _in_turn(plates, links, "first_plate", "last_plate", PLATE_ROW_SIZE)


def _wrench_noise(
    sensor: ForceTorque | FreeWrench, frames: int
) -> tuple[Array | None, Array | None, Array | None, Array]:
    """A plate's axes and place in the world, or a sensor's way to its link; and the covariance."""
    if isinstance(sensor, FreeWrench):
        variances = [sensor.force_sd**2] * 3 + [sensor.moment_sd**2] * 3
        return None, None, None, checked_blocks(describe(sensor), np.diag(variances))[None]
    block = blocks(sensor, sensor.covariance, frames, 6)
    if sensor.fixed_to == "world":
        place = point(sensor, sensor.position, frames)
        return turning(sensor, sensor.rotation, frames), place, None, block
    carry = wrench_carrier(sensor, frames)
    if carry is not None:
        block = symmetric(carry @ block @ transposed(carry))
    return None, None, carry, block


def _pairs(tree: EstimationTree, sites: Sequence[str]) -> tuple[IntArray, IntArray]:
    """Returns each pair of sites, a site with itself included, and the paths to where they meet."""
    where = [tree.path(tree.link_names.index(name)) for name in sites]
    pairs, paths = [], [0]
    for row, first in enumerate(where):
        for column, second in enumerate(where[row:], row):
            meeting = next(link for link in second if link in first)
            pair = [row, column, first[0], second[0], meeting]
            for path in (first, second):
                start = len(paths)
                paths.extend(path[: path.index(meeting)])
                pair.extend([start, len(paths)])
            pairs.append(pair)
    table = np.array(pairs, dtype=np.int64).reshape(-1, PAIR_ROW_SIZE)
    return table, np.array(paths, dtype=np.int64)
