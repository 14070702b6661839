"""A person of a known law, led by the hands with the feet or the pelvis in place."""

import numpy as np

from human import Chain, HumanModel, Motion, motion_from_configurations
from human.rotations import (
    matrix_to_quaternion,
    matrix_to_rotation_vector,
    rotation_vector_to_matrix,
)

#: Knees bent and a box in the hands; degrees, those on the left mirrored, others zero.
HOLDING_DEG = {
    "jShoulder_rotx": 70.0,
    "jShoulder_rotz": 20.0,
    "jElbow_rotz": 75.0,
    "jHip_roty": -25.0,
    "jKnee_roty": 45.0,
    "jAnkle_roty": -20.0,
}
RATE_HZ = 30.0


def holding(chain: Chain) -> np.ndarray:
    """The start posture, symmetric: turns about x and z change sign on the left."""
    q = np.zeros(chain.n)
    for name, angle in HOLDING_DEG.items():
        for side in ("Right", "Left"):
            full = "j" + side + name[1:]
            if full in chain.dof_names:
                sign = -1.0 if side == "Left" and not name.endswith("y") else 1.0
                q[chain.dof_names.index(full)] = sign * np.deg2rad(angle)
    return q


def mobility(chain: Chain) -> np.ndarray:
    """W of the person: a stiff back, quick elbows and knees."""
    weights = np.ones(chain.n)
    for part, weight in {"L5": 0.1, "L4": 0.05, "T12": 0.05, "T9": 0.1, "C7": 0.2}.items():
        weights[[part in name for name in chain.dof_names]] = weight
    weights[["Elbow" in name or "Knee" in name for name in chain.dof_names]] = 3.0
    return weights


def tips_at(chain: Chain, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position ``(tips, 3)`` and rotation ``(tips, 3, 3)`` of all tips."""
    position, rotation = chain.forward(q)
    return position.reshape(-1, 3), rotation.reshape(-1, 3, 3)


def object_way(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Shift ``(T, 3)`` m and rotation vector ``(T, 3)`` of an object taken out and back."""
    share = np.linspace(0.0, 1.0, int(0.8 * RATE_HZ) + 1)
    out = share**3 * (10 - 15 * share + 6 * share**2)
    once = np.concatenate([out[:-1], out[:0:-1]])
    goals = rng.uniform([-0.12, -0.15, -0.2], [0.18, 0.15, 0.2], (count, 3))
    turns = rng.uniform(-0.3, 0.3, (count, 3))
    return (
        np.concatenate([once[:, None] * goal for goal in goals]),
        np.concatenate([once[:, None] * turn for turn in turns]),
    )


def led(
    chain: Chain, shift: np.ndarray, turn: np.ndarray, rng: np.random.Generator, sd: float = 0.02
) -> np.ndarray:
    """Postures ``(T, n)`` of who follows `mobility`, with coherent null-space noise (rad/s).

    The held tips stay; the led ones go with one object, turned about their middle.
    """
    q, W, held = holding(chain), mobility(chain), chain.held_tips
    place, facing = tips_at(chain, q)
    middle = place[held:].mean(axis=0)
    noise, memory, out = np.zeros(chain.n), np.exp(-1 / (0.3 * RATE_HZ)), []
    for step, (by, about) in enumerate(zip(shift, turn, strict=True)):
        R = rotation_vector_to_matrix(about)
        goal, facing_goal = place.copy(), facing.copy()
        goal[held:] = middle + by + (place[held:] - middle) @ R.T
        facing_goal[held:] = R @ facing[held:]
        noise = memory * noise + np.sqrt(1 - memory**2) * sd * rng.standard_normal(chain.n)
        for correction in range(3):
            position, rotation = tips_at(chain, q)
            J = chain.jacobian(q)
            error = matrix_to_rotation_vector(facing_goal @ np.swapaxes(rotation, 1, 2))
            wanted = np.concatenate([(goal - position).ravel(), error.ravel()])
            gain = (W[:, None] * J.T) @ np.linalg.inv((J * W) @ J.T)
            q = q + gain @ wanted
            if correction == 0 and step:
                stray = noise * np.sqrt(W) / RATE_HZ
                q = q + stray - gain @ (J @ stray)
        out.append(q)
    return np.array(out)


def motion_of(chain: Chain, q: np.ndarray) -> Motion:
    """The whole body's motion, its other joints at zero; with the feet fixed the pelvis moves."""
    model: HumanModel = chain.model
    full = np.tile(model.neutral(), (len(q), 1))
    full[:, 7 + chain.dof_indices] = q
    if chain.base != "Pelvis":
        up = Chain(model, "Pelvis", chain.base)
        position, rotation = up.forward(full[:, 7:][:, up.dof_indices])
        full[:, :3], full[:, 3:7] = position, matrix_to_quaternion(rotation)
    time_s = np.arange(len(q)) / RATE_HZ
    return motion_from_configurations(model.dof_names, time_s, full)
