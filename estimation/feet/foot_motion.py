"""How heel and toes move, from a motion of the whole body: for contacts without forces."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimation.errors import MeasurementError
from estimation.feet.contacts import FootMotion
from estimation.spatial import cross, times
from human import HumanModel
from human.rotations import quaternion_to_matrix
from human.shapes import Box

Array = NDArray[np.float64]

SIDES = ("Right", "Left")


def sole_points(model: HumanModel, side: str) -> tuple[tuple[str, Array], ...]:
    """Returns heel and toe tip of a foot as (segment, ``(3,)`` m in segment axes).

    They are the lower rear edge of the foot's solid and the lower front edge of the toes'; of a
    model without solids the two segments' origins.

    Args:
        model: the person.
        side: ``Right`` or ``Left``.

    Raises:
        human.UnknownNameError: the model has no such foot.
    """
    points = []
    for segment, end in ((f"{side}Foot", -0.5), (f"{side}Toe", 0.5)):
        model.segment_index(segment)
        solid = model.shapes.get(segment)
        at = np.zeros(3)
        if isinstance(solid, Box):
            length, _, thickness = solid.size
            at = np.asarray(solid.center) + np.array([end * length, 0.0, -0.5 * thickness])
        points.append((segment, at))
    return tuple(points)


def sole_motion(
    model: HumanModel,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike | None = None,
    *,
    floor_height_m: float = 0.0,
    belt_velocity: ArrayLike = (0.0, 0.0, 0.0),
) -> FootMotion:
    """Computes height, speed and acceleration of both soles, heel and toe tip of each.

    Args:
        model: the person.
        q: ``(time, nq)`` configurations.
        v: ``(time, nv)`` velocities, base twist in body axes.
        a: ``(time, nv)`` accelerations; None if unknown: they shall be measured, or the result of a
            short window, or they show a switch late.
        floor_height_m: of the floor in world axes; of who stands in ``q`` if that is not zero.
        belt_velocity: ``(3,)`` m/s, world axes, what resting feet move at on a treadmill.

    Raises:
        MeasurementError: shapes do not fit or a number is not finite.
        human.UnknownNameError: the model lacks a foot.
    """
    q, v = (np.asarray(x, dtype=np.float64) for x in (q, v))
    rate = np.zeros_like(v) if a is None else np.asarray(a, dtype=np.float64)
    for name, array, width in (("q", q, model.nq), ("v", v, model.nv), ("a", rate, model.nv)):
        if array.ndim != 2 or array.shape != (len(q), width):
            raise MeasurementError(f"{name}: expected shape ({len(q)}, {width}), got {array.shape}")
        bad = ~np.isfinite(array).all(axis=1)
        if np.any(bad):
            raise MeasurementError(f"{name}: expected finite numbers", int(np.argmax(bad)))
    belt = np.asarray(belt_velocity, dtype=np.float64)
    height, speed, acceleration = (np.empty((len(q), 2, 2)) for _ in range(3))
    for side, name in enumerate(SIDES):
        points = sole_points(model, name)
        bodies = limb_motion(model, [segment for segment, _ in points], q, v, rate)
        for k, (body, (_, local)) in enumerate(zip(bodies, points, strict=True)):
            at = body.at(local)
            height[:, side, k] = at.position[:, 2] - floor_height_m
            speed[:, side, k] = np.linalg.norm(at.velocity - belt, axis=-1)
            acceleration[:, side, k] = np.linalg.norm(at.acceleration, axis=-1)
    return FootMotion(height, speed, None if a is None else acceleration)


@dataclass(frozen=True, slots=True)
class LimbSegment:
    """How one segment moves, world axes, ``(time, ...)``; accelerations without gravity."""

    rotation: Array
    omega: Array
    alpha: Array
    position: Array
    velocity: Array
    acceleration: Array

    def at(self, local: Array) -> "LimbSegment":
        """The same body seen at another of its points."""
        lever = self.rotation @ local
        along = cross(self.omega, lever)
        return replace(
            self,
            position=self.position + lever,
            velocity=self.velocity + along,
            acceleration=self.acceleration + cross(self.alpha, lever) + cross(self.omega, along),
        )

    def turned(self, axis: int, angle: Array, rate: Array, change: Array) -> "LimbSegment":
        """The next body, turned against this one about one of its axes."""
        about = self.rotation[:, :, axis]
        spin = about * rate[:, None]
        rotation = self.rotation.copy()
        first, second = (axis + 1) % 3, (axis + 2) % 3
        cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
        rotation[:, :, first] = (
            cosine * self.rotation[:, :, first] + sine * self.rotation[:, :, second]
        )
        rotation[:, :, second] = (
            cosine * self.rotation[:, :, second] - sine * self.rotation[:, :, first]
        )
        return replace(
            self,
            rotation=rotation,
            omega=self.omega + spin,
            alpha=self.alpha + about * change[:, None] + cross(self.omega, spin),
        )


def limb_motion(
    model: HumanModel, wanted: list[str], q: Array, v: Array, a: Array
) -> list[LimbSegment]:
    """Returns the motion of segments of one limb, the last one furthest from the pelvis.

    Derived here: joint by joint from the pelvis, ``omega += s e``, ``alpha += s' e + omega x s e``,
    and the transport of velocity and acceleration along each offset.
    """
    way = [model.segment_index(wanted[-1])]
    while way[0]:
        way.insert(0, model.parents[way[0]])
    R = quaternion_to_matrix(q[:, 3:7])
    omega_body, linear = v[:, 3:6], v[:, :3]
    body = LimbSegment(
        rotation=R,
        omega=times(R, omega_body),
        alpha=times(R, a[:, 3:6]),
        position=q[:, :3],
        velocity=times(R, linear),
        acceleration=times(R, a[:, :3] + cross(omega_body, linear)),
    )
    found = {}
    for segment in way:
        if segment:
            body = body.at(model.offsets[segment - 1])
            for dof in model.joint_dofs(segment - 1):
                axis = int(model.dof_axes[dof])
                body = body.turned(axis, q[:, 7 + dof], v[:, 6 + dof], a[:, 6 + dof])
        found[model.segment_names[segment]] = body
    return [found[name] for name in wanted]
