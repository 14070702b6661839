"""How wrong a model may be, and what that does to an estimate: bands beyond the sensors' noise.

The sensors' noise is new at every frame; a wrong mass, length, joint angle or plate is the same at
all of them, and no averaging over frames removes it. So the estimate is repeated with bodies drawn
at random, on a few frames, and the spread of the answers widens the bands.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from scipy.special import ndtri, stdtrit

from estimation.errors import MeasurementError
from estimation.estimate_record import Estimate
from estimation.sensors import ForceTorque, Measurement
from estimation.spatial import Array, symmetric, times, transposed
from estimation.tree import BASE_NQ, BASE_NV, EstimationTree
from estimation.tree_kinematics import tree_kinematics

#: Estimates means from a tree, configurations and measurements.
Means = Callable[[EstimationTree, Array, Sequence[Measurement]], Estimate]


_NOWHERE: Mapping[str, Array] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class ModelErrors:
    """Standard deviations of errors that stay the same through a run.

    Attributes:
        segment_mass: of each segment's mass, as a share.
        segment_length: of each segment's length, as a share.
        joint_angle_deg: of each joint angle, degrees.
        plate_offset_m: of where each foot's measured force acts, along each horizontal axis, m.
        feet_seen: whether a foot's place on its plate was seen, as by markers on it, so that angles
            and lengths that are wrong move its force along with it. Else they move the feet under
            forces that stay where they are, and every leg is the less certain.
        pairs: how many pairs of opposite draws.
        grid_s: how far apart in time the draws are worked out; between, they are interpolated.

    Raises:
        MeasurementError: a value makes no sense.
    """

    segment_mass: float = 0.05
    segment_length: float = 0.02
    joint_angle_deg: float = 2.0
    plate_offset_m: float = 0.005
    feet_seen: bool = False
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
                raise MeasurementError(f"model error {name}: expected 0 to {most:g}, got {value}")
        if self.pairs < 2 or not self.grid_s > 0.0:
            raise MeasurementError(
                "model errors: "
                f"expected two or more pairs and a grid above 0 s, got {self.pairs}, {self.grid_s}",
            )

    @property
    def widening(self) -> float:
        """What makes 95 % of a spread that is known from a few pairs only: Student's t."""
        return float(stdtrit(self.pairs, 0.975) / ndtri(0.975))


@dataclass(frozen=True, slots=True, eq=False)
class ModelDraw:
    """One body, posture and plate placement that may be the true ones, as a departure.

    Attributes:
        mass: ``(n_links,)`` share by which each link is heavier.
        length: ``(n_links,)`` share by which it is longer.
        angle: ``(n_dof,)`` rad by which each joint angle is larger.
        plate_m: force sensor fixed to the world, by its link, to the ``(3,)`` m by which its point
            is off.
    """

    mass: Array
    length: Array
    angle: Array
    plate_m: dict[str, Array]

    def opposite(self) -> "ModelDraw":
        """Returns the draw with every departure reversed."""
        plates = {name: -shift for name, shift in self.plate_m.items()}
        return ModelDraw(-self.mass, -self.length, -self.angle, plates)

    def tree(self, tree: EstimationTree) -> EstimationTree:
        """Returns the tree of that body."""
        longer = 1.0 + self.length
        parents = np.maximum(np.array(tree.parents), 0)
        inertias = tree.inertias * (1.0 + self.mass)[:, None, None]
        inertias[:, :3, 3:] *= longer[:, None, None]
        inertias[:, 3:, :3] *= longer[:, None, None]
        inertias[:, 3:, 3:] *= longer[:, None, None] ** 2
        return replace(tree, offsets=tree.offsets * longer[parents, None], inertias=inertias)

    def configuration(self, q: Array) -> Array:
        """Returns configurations ``(frames, 7 + n_dof)`` with those joint angles."""
        out = q.copy()
        out[:, BASE_NQ:] += self.angle
        return out

    def sensors(
        self, measurements: Sequence[Measurement], moved: Mapping[str, Array] = _NOWHERE
    ) -> list[Measurement]:
        """Returns the measurements with force plates where that draw has them.

        Args:
            measurements: as believed.
            moved: link to ``(m, 3)`` m by which this draw has it elsewhere, and its plate with it.
        """
        out: list[Measurement] = []
        for sensor in measurements:
            if isinstance(sensor, ForceTorque) and sensor.link in self.plate_m:
                place = np.asarray(sensor.position) + self.plate_m[sensor.link]
                sensor = replace(sensor, position=place + moved.get(sensor.link, 0.0))
            out.append(sensor)
        return out


def draw_models(
    tree: EstimationTree,
    errors: ModelErrors,
    rng: np.random.Generator,
    *,
    plates: Sequence[str] = (),
    heading_rad: float = 0.0,
    body_mass_sd_kg: float | None = None,
) -> tuple[ModelDraw, ...]:
    """Draws ``errors.pairs`` bodies; each stands for its opposite, too.

    Args:
        tree: the body as believed.
        errors: how wrong it may be.
        rng: source of all randomness.
        plates: links whose force sensors are fixed to the world and may be misplaced.
        heading_rad: where the person faces, from the world's x axis towards y: draws are theirs,
            not the world's, so that a scene that is turned has the same bands.
        body_mass_sd_kg: how well the whole body's mass is known if it was weighed; None if not:
            then it is as uncertain as the sum of its parts.
    """
    masses, draws = tree.inertias[:, 0, 0], []
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    for _ in range(errors.pairs):
        mass = errors.segment_mass * rng.normal(size=tree.n_links)
        length = errors.segment_length * rng.normal(size=tree.n_links)
        angle = np.radians(errors.joint_angle_deg) * rng.normal(size=tree.n_dof)
        shift = errors.plate_offset_m * rng.normal(size=(len(plates), 2)) @ [[c, s], [-s, c]]
        if body_mass_sd_kg is not None:
            wanted = body_mass_sd_kg * rng.normal()
            mass = mass + (wanted - float(masses @ mass)) / tree.mass_kg
        offsets = {name: np.array([*shift[row], 0.0]) for row, name in enumerate(plates)}
        draws.append(ModelDraw(mass, length, angle, offsets))
    return tuple(draws)


@dataclass(frozen=True, slots=True, eq=False)
class ModelSpread:
    """Half the difference that each pair of opposite draws makes, on some frames.

    Attributes:
        time_s: ``(m,)`` s, the frames' times.
        torque: ``(pairs, m, n_dof)`` N m.
        joint_wrench: ``(pairs, m, n_links - 1, 6)`` N, N m, in each draw's own child axes.
        external_wrench: ``(pairs, m, n_links, 6)`` N, N m, world axes, about the links' origins.
        widening: factor on standard deviations, because the pairs are few.
    """

    time_s: Array
    torque: Array
    joint_wrench: Array
    external_wrench: Array
    widening: float

    def at(self, deviation: Array, time_s: Array) -> Array:
        """Interpolates deviations ``(pairs, m, ...)`` to other times: ``(pairs, n, ...)``."""
        count = len(self.time_s)
        right = np.clip(np.searchsorted(self.time_s, time_s), 1, max(count - 1, 1))
        if count == 1:
            return np.repeat(deviation, len(time_s), axis=1)
        left = right - 1
        span = self.time_s[right] - self.time_s[left]
        share = np.clip((time_s - self.time_s[left]) / span, 0.0, 1.0)
        share = share.reshape(-1, *[1] * (deviation.ndim - 2))
        return np.asarray(deviation[:, left] * (1.0 - share) + deviation[:, right] * share)

    def variance(self, deviation: Array, time_s: Array) -> Array:
        """Returns variances ``(n, ...)`` of deviations ``(pairs, m, ...)`` at other times."""
        mean = np.mean(np.square(deviation), axis=0, keepdims=True)
        return np.asarray(self.widening**2 * self.at(mean, time_s)[0])

    def covariance(self, deviation: Array, time_s: Array) -> Array:
        """Returns covariances ``(n, ..., k, k)`` of deviations ``(pairs, m, ..., k)``."""
        mean = np.einsum("p...i,p...j->...ij", deviation, deviation) / len(deviation)
        return np.asarray(self.widening**2 * self.at(mean[None], time_s)[0])


def model_spread(
    tree: EstimationTree,
    q: Array,
    time_s: Array,
    measurements: Sequence[Measurement],
    errors: ModelErrors,
    draws: Sequence[ModelDraw],
    means: Means,
) -> ModelSpread:
    """Repeats an estimate with drawn models.

    Args:
        tree: the body as believed.
        q: ``(m, 7 + n_dof)`` configurations of the frames to do it on.
        time_s: ``(m,)`` s, their times.
        measurements: at those frames.
        errors: what the draws are made of.
        draws: from `draw_models`.
        means: the estimate itself; standard deviations are not needed.

    Derived here: with opposite draws ``+d`` and ``-d`` half the difference of the answers is their
    effect without terms of second order, so that few pairs are enough.
    """
    torque, joint, external = [], [], []
    seen = _places(tree, q) if errors.feet_seen else {}
    for draw in draws:
        found = []
        for side in (draw, draw.opposite()):
            body, posture = side.tree(tree), side.configuration(q)
            places = _places(body, posture) if seen else {}
            moved = {name: places[name] - seen[name] for name in places if name in side.plate_m}
            found.append(means(body, posture, side.sensors(measurements, moved)))
        torque.append(0.5 * (found[0].torque - found[1].torque))
        joint.append(0.5 * (found[0].joint_wrench - found[1].joint_wrench))
        world = [in_world(each.external_wrench, each.link_rotation) for each in found]
        external.append(0.5 * (world[0] - world[1]))
    return ModelSpread(
        time_s, np.array(torque), np.array(joint), np.array(external), errors.widening
    )


def _places(tree: EstimationTree, q: Array) -> dict[str, Array]:
    """Returns where each link is, ``(m, 3)`` m."""
    position = tree_kinematics(tree, q, np.zeros((len(q), BASE_NV + tree.n_dof))).position
    return dict(zip(tree.link_names, position, strict=True))


def in_world(wrench: Array, rotation: Array) -> Array:
    """Returns wrenches ``(..., 6)`` turned by rotations ``(..., 3, 3)``."""
    turned = times(rotation[..., None, :, :], wrench.reshape(*wrench.shape[:-1], 2, 3))
    return turned.reshape(wrench.shape)


def widened(estimate: Estimate, spread: ModelSpread, time_s: Array) -> Estimate:
    """Returns an estimate whose bands hold errors of the model beside the sensors' noise.

    Args:
        estimate: with standard deviations.
        spread: from `model_spread`, on frames of the same stretch.
        time_s: ``(n,)`` s, of the estimate's frames.

    Raises:
        MeasurementError: the estimate has no standard deviations, or a preset's.
    """
    if estimate.torque_sd is None or estimate.bands != "uncertainty":
        raise MeasurementError(
            f"widened: expected bands that are 'uncertainty', got {estimate.bands!r}"
        )
    assert estimate.joint_wrench_sd is not None
    assert estimate.external_wrench_sd is not None
    assert estimate.joint_moment_covariance is not None
    joint = spread.variance(spread.joint_wrench, time_s)
    moments = spread.covariance(spread.joint_wrench[..., 3:], time_s)
    n = len(estimate.frames)
    # Wrenches on links are told in world axes and turned back by the pose as believed: a hand that
    # is turned a little bears the same load.
    world = spread.covariance(
        spread.external_wrench.reshape(*spread.external_wrench.shape[:-1], 2, 3), time_s
    )
    back = transposed(estimate.link_rotation)[:, :, None]
    own = np.diagonal(back @ world @ transposed(back), axis1=-2, axis2=-1)
    external = own.reshape(n, -1, 6)
    return replace(
        estimate,
        torque_sd=np.sqrt(estimate.torque_sd**2 + spread.variance(spread.torque, time_s)),
        joint_wrench_sd=np.sqrt(estimate.joint_wrench_sd**2 + joint),
        external_wrench_sd=np.sqrt(estimate.external_wrench_sd**2 + external),
        joint_moment_covariance=estimate.joint_moment_covariance + moments,
        site_covariance=_sites(estimate, spread, time_s),
        bands="widened",
    )


def _sites(estimate: Estimate, spread: ModelSpread, time_s: Array) -> Array | None:
    if estimate.site_covariance is None or not estimate.sites:
        return estimate.site_covariance
    links = [estimate.link(name) for name in estimate.sites]
    deviation = spread.external_wrench[:, :, links]
    world = spread.covariance(deviation.reshape(*deviation.shape[:2], -1), time_s)
    turn = np.zeros_like(world)
    for place, link in enumerate(links):
        for part in (6 * place, 6 * place + 3):
            turn[:, part : part + 3, part : part + 3] = estimate.link_rotation[:, link]
    return estimate.site_covariance + symmetric(transposed(turn) @ world @ turn)
