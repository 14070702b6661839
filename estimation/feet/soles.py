"""Where the soles are on the floor, and how far outside of them a force enters."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.feet.foot_motion import SIDES, limb_motion
from estimation.spatial import Array
from human import HumanModel
from human.shapes import Box

Mask = NDArray[np.bool_]

#: Directions in which an outline's reach is compared; 24 leave the distance 1 % short at most.
_DIRECTIONS = 24
#: Half the width of a foot whose model has no solids, m.
_HALF_WIDTH_M = 0.05


@dataclass(frozen=True, slots=True)
class Soles:
    """Corners of both soles over time, world axes; right, then left.

    Attributes:
        corners: ``(frames, 2, points, 3)`` m, of the lower faces of foot and toes.
    """

    corners: Array

    @property
    def center(self) -> Array:
        """``(frames, 2, 3)`` m, the middle of each sole."""
        return np.asarray(self.corners.mean(axis=2))

    def outside_m(self, point: Array) -> Array:
        """Returns how far points ``(frames, 2)`` of the floor are outside of each sole, and both.

        Returns:
            ``(frames, 3)`` m from the right sole, the left one, and the hull of the two; zero
            inside.

        Derived here: a point is outside of a convex outline by the largest amount, over all
        directions, that it reaches further than every corner.
        """
        angle = np.arange(_DIRECTIONS) * (2.0 * np.pi / _DIRECTIONS)
        toward = np.stack([np.cos(angle), np.sin(angle)])
        reach = np.max(self.corners[..., :2] @ toward, axis=2)
        both = np.max(reach, axis=1, keepdims=True)
        beyond = (point @ toward)[:, None, :] - np.concatenate([reach, both], axis=1)
        return np.asarray(np.maximum(np.max(beyond, axis=-1), 0.0))

    def share_inside(self, outlines: list[Array]) -> Array:
        """Returns the share ``(frames, 2)`` of each sole that lies in one of some convex outlines.

        Args:
            outlines: ``(4, 3)`` m each, corners in order around.
        """
        # A grid over each sole: corners, and the points halfway to each other and to the middle.
        points = np.concatenate(
            [
                self.corners,
                0.5 * (self.corners + np.roll(self.corners, 1, axis=2)),
                0.5 * (self.corners + self.center[:, :, None]),
            ],
            axis=2,
        )[..., :2]
        inside = np.zeros(points.shape[:-1], dtype=np.bool_)
        for outline in outlines:
            edge = np.roll(outline, -1, axis=0)[:, :2] - outline[:, :2]
            away = points[..., None, :] - outline[:, :2]
            side = edge[:, 0] * away[..., 1] - edge[:, 1] * away[..., 0]
            inside |= np.all(side >= 0.0, axis=-1) | np.all(side <= 0.0, axis=-1)
        return np.asarray(inside.mean(axis=-1))


def sole_corners(model: HumanModel, side: str) -> tuple[tuple[str, Array], ...]:
    """Returns the lower face of foot and toes as (segment, ``(4, 3)`` m in segment axes).

    Of a model without solids they are as long as the way from ankle to toes says.

    Raises:
        human.UnknownNameError: the model has no such foot.
    """
    ball = np.asarray(model.offsets[model.segment_index(f"{side}Toe") - 1])
    guess = {
        f"{side}Foot": ((-0.4 * ball[0], ball[0]), ball[2]),
        f"{side}Toe": ((0.0, 0.4 * ball[0]), 0.0),
    }
    out = []
    for segment, ((rear, front), low) in guess.items():
        width = (-_HALF_WIDTH_M, _HALF_WIDTH_M)
        solid = model.shapes.get(segment)
        if isinstance(solid, Box):
            half = 0.5 * np.asarray(solid.size)
            center = np.asarray(solid.center)
            rear, front = center[0] - half[0], center[0] + half[0]
            width = (center[1] - half[1], center[1] + half[1])
            low = center[2] - half[2]
        corners = [
            (x, y, low)
            for x, y in zip((rear, front, front, rear), np.repeat(width, 2), strict=True)
        ]
        out.append((segment, np.array(corners)))
    return tuple(out)


def soles_of(model: HumanModel, q: Array) -> Soles:
    """Returns where the soles are.

    Args:
        model: the person.
        q: ``(frames, nq)`` configurations.

    Raises:
        human.UnknownNameError: the model lacks a foot.
    """
    still = np.zeros((len(q), model.nv))
    feet = []
    for side in SIDES:
        faces = sole_corners(model, side)
        bodies = limb_motion(model, [segment for segment, _ in faces], q, still, still)
        feet.append(
            np.concatenate(
                [
                    body.position[:, None] + local @ np.swapaxes(body.rotation, -1, -2)
                    for body, (_, local) in zip(bodies, faces, strict=True)
                ],
                axis=1,
            )
        )
    return Soles(np.stack(feet, axis=1))
