"""Chains with several tips: both hands on one object, and a hand with both feet on the floor."""

from dataclasses import dataclass

import numpy as np
import pytest
from whole_body import holding

from human import Chain, HumanModel, Subject, generate_model
from human.names import mirrored
from human.rotations import rotation_vector_to_matrix
from prediction import (
    Familiarity,
    Follower,
    HandNoise,
    HandPath,
    JointLimits,
    JointReduction,
    MinimumNormIk,
    PostureBand,
    Rollout,
    StartMismatchError,
    TrajectoryError,
    UnreachableTrajectoryError,
    demonstrations_from_samples,
)

HANDS = ("RightHandCOM", "LeftHandCOM")
CHAINS = {
    "both hands": (HANDS, "Pelvis", ()),
    "right hand, feet fixed": ("RightHandCOM", "RightFoot", ("LeftFoot",)),
    "both hands, feet fixed": (HANDS, "RightFoot", ("LeftFoot",)),
}


@pytest.fixture(scope="module")
def person() -> HumanModel:
    return generate_model(Subject(1.75, 72.0))


def follower_of(chain: Chain, task: str = "pose") -> Follower:
    rng = np.random.default_rng(0)
    time_s = np.linspace(0.0, 12.0, 361)
    amplitude, phase = np.full(chain.n, 0.1), rng.uniform(0, 6, chain.n)
    rate = rng.uniform(0.5, 2.0, chain.n)
    swing = rate * time_s[:, None] + phase
    q = holding(chain) + amplitude * np.sin(swing)
    seen = demonstrations_from_samples(chain, q, amplitude * rate * np.cos(swing), time_s)
    moment = seen.qdot.T @ seen.qdot / len(seen)
    return Follower(
        MinimumNormIk.fit(seen.for_task(task), rng),
        chain,
        JointReduction.identity(chain.dof_names),
        JointLimits(np.eye(chain.n), chain.lower, chain.upper).widened_to(holding(chain)),
        PostureBand(0.04 * np.eye(chain.n), 1.0, moment),
        Familiarity.of(seen),
        task,
    )


@pytest.fixture(scope="module", params=CHAINS)
def follower(request, person) -> Follower:
    return follower_of(Chain(person, *CHAINS[request.param]))


def lifted(chain: Chain, points: int = 30, by=(0.10, 0.08, 0.10), turn=0.3) -> HandPath:
    """One object, held by the led tips, carried along and turned about the vertical."""
    start = HandPath.recorded(chain, holding(chain)[None], np.zeros(1), "pose")
    position = start.position[0].reshape(-1, 3)
    rotation = start.rotation[0].reshape(-1, 3, 3)
    share = np.linspace(0.0, 1.0, points)
    turned = rotation_vector_to_matrix(share[:, None] * np.array([0.0, 0.0, turn]))
    middle = position.mean(axis=0)
    way = middle + share[:, None] * np.array(by)
    places = way[:, None] + np.einsum("tij,hj->thi", turned, position - middle)
    poses = turned[:, None] @ rotation
    if len(position) == 1:
        places, poses = places[:, 0], poses[:, 0]
    return HandPath.checked(0.04 * np.arange(points), places, poses)


@dataclass(frozen=True)
class Seen:
    position: np.ndarray  # (..., tips, 3)
    rotation: np.ndarray  # (..., tips, 3, 3)

    @classmethod
    def of(cls, chain: Chain, q: np.ndarray) -> "Seen":
        position, rotation = chain.forward(q)
        batch = q.shape[:-1]
        return cls(position.reshape(*batch, -1, 3), rotation.reshape(*batch, -1, 3, 3))

    def apart(self) -> tuple[np.ndarray, np.ndarray]:
        """Pose of the last tip as the one before it sees it."""
        back = np.swapaxes(self.rotation[..., -2, :, :], -1, -2)
        between = self.position[..., -1, :] - self.position[..., -2, :]
        return (back @ between[..., None])[..., 0], back @ self.rotation[..., -1, :, :]


def test_every_tip_is_where_it_must_be(follower):
    chain, path = follower.chain, lifted(follower.chain)
    rollout = follower.rollout(path, holding(chain), 12, np.random.default_rng(1))
    assert rollout.followed.all()
    assert rollout.q.std(axis=0).max() > 0.01
    seen, start = Seen.of(chain, rollout.q), Seen.of(chain, holding(chain))
    held = chain.held_tips
    off = np.linalg.norm(seen.position[..., :held, :] - start.position[:held], axis=-1)
    assert off.max(initial=0.0) < 2e-4
    np.testing.assert_allclose(
        seen.rotation[..., :held, :, :] - start.rotation[:held], 0.0, atol=2e-3
    )
    led = path.position.reshape(len(path.time_s), -1, 3)
    off = np.linalg.norm(seen.position[..., held:, :] - led, axis=-1)
    assert off.max() < 2e-4 and off.mean() < 5e-5
    np.testing.assert_allclose(off.max(axis=-1), rollout.hand_error_m, atol=2e-4)


def test_the_robots_error_moves_both_hands_as_one_body(person):
    chain = Chain(person, HANDS)
    rollout = follower_of(chain).rollout(
        lifted(chain), holding(chain), 40, np.random.default_rng(1), hand_noise=HandNoise(0.01, 0.1)
    )
    seen, start = Seen.of(chain, rollout.q), Seen.of(chain, holding(chain))
    assert seen.position[:, -1, 0].std(axis=0).min() > 5e-3
    (between, turn), (at_first, at_first_turn) = seen.apart(), start.apart()
    assert np.linalg.norm(between - at_first, axis=-1).max() < 2e-4
    np.testing.assert_allclose(turn - at_first_turn, 0.0, atol=2e-3)


def test_feet_stand_though_the_robot_errs(person):
    chain = Chain(person, *CHAINS["right hand, feet fixed"])
    rollout = follower_of(chain).rollout(
        lifted(chain), holding(chain), 20, np.random.default_rng(1), hand_noise=HandNoise(0.01, 0.1)
    )
    seen, start = Seen.of(chain, rollout.q), Seen.of(chain, holding(chain))
    assert np.linalg.norm(seen.position[..., 0, :] - start.position[0], axis=-1).max() < 2e-4


@pytest.mark.parametrize("base", ["pelvis", "feet"])
def test_the_left_hand_is_the_mirror_of_the_right(person, base):
    """Mirrored task, mirrored posture; turns about x and z change sign, those about y do not."""
    centrals = []
    for side in ("Right", "Left"):
        feet = (f"{side}Foot", (mirrored(f"{side}Foot"),)) if base == "feet" else ("Pelvis", ())
        chain = Chain(person, f"{side}HandCOM", *feet)
        sideways = 1.0 if side == "Right" else -1.0
        path = lifted(chain, by=(0.10, 0.08 * sideways, 0.10), turn=0.3 * sideways)
        run = follower_of(chain).rollout(
            path, holding(chain), 0, np.random.default_rng(0), noise="none"
        )
        centrals.append(dict(zip(chain.dof_names, run.central.T, strict=True)))
    right, left = centrals
    assert {mirrored(name) for name in right} == set(left)
    for name, angle in right.items():
        sign = 1.0 if name.endswith("y") else -1.0
        np.testing.assert_allclose(left[mirrored(name)], sign * angle, atol=1e-9)


def test_positions_alone_leave_hands_free_to_turn_but_not_the_foot(person):
    chain = Chain(person, *CHAINS["right hand, feet fixed"])
    path = lifted(chain)
    alone = HandPath(path.time_s, path.position, None)
    follower = follower_of(chain, "position")
    rollout = follower.rollout(alone, holding(chain), 8, np.random.default_rng(1))
    seen, start = Seen.of(chain, rollout.q), Seen.of(chain, holding(chain))
    assert np.linalg.norm(seen.position[..., 1, :] - path.position, axis=-1).max() < 2e-4
    np.testing.assert_allclose(seen.rotation[..., 0, :, :] - start.rotation[0], 0.0, atol=2e-3)
    assert np.abs(seen.rotation[:, -1, 1] - path.rotation[-1]).max() > 0.02


def test_limits_hold_and_so_do_hands_and_feet(person):
    chain = Chain(person, *CHAINS["both hands, feet fixed"])
    follower, q0 = follower_of(chain), holding(chain)
    free = follower.rollout(lifted(chain), q0, 12, np.random.default_rng(1))
    widest = np.abs(free.q - q0).max(axis=(0, 1))
    tight = np.maximum(0.7 * widest, 0.02)
    limits = JointLimits(np.eye(chain.n), q0 - tight, q0 + tight)
    bound = Follower(
        follower.predictor,
        chain,
        follower.reduction,
        limits,
        follower.band,
        follower.familiarity,
    ).rollout(lifted(chain), q0, 12, np.random.default_rng(1))
    assert bound.followed.mean() > 0.9
    kept = bound.q[bound.followed]
    assert (np.abs(kept - q0) - tight).max() < 1.1e-3
    assert (np.abs(np.abs(kept - q0) - tight) < 1e-4).any()
    assert bound.hand_error_m[bound.followed].max() < 2.1e-3
    assert bound.hand_error_m[bound.followed].mean() < 2e-4


def test_who_cannot_reach_or_does_not_hold_is_named(person):
    chain = Chain(person, HANDS)
    follower, path = follower_of(chain), lifted(chain)
    start = path.position.copy()
    start[:, 1, 0] += 0.05
    with pytest.raises(StartMismatchError, match="LeftHandCOM") as mismatch:
        follower.rollout(
            HandPath(path.time_s, start, path.rotation), holding(chain), 1, np.random.default_rng(0)
        )
    assert mismatch.value.distance_m == pytest.approx(0.05, abs=1e-9)
    away = path.position.copy()
    away[:, 0, 1] -= np.linspace(0.0, 1.5, len(away))
    with pytest.raises(UnreachableTrajectoryError, match="HandCOM") as unreachable:
        follower.rollout(
            HandPath(path.time_s, away, path.rotation), holding(chain), 1, np.random.default_rng(0)
        )
    assert unreachable.value.tip in HANDS
    with pytest.raises(TrajectoryError, match="leads 2"):
        one = HandPath(path.time_s, path.position[:, 0], path.rotation[:, 0])
        follower.rollout(one, holding(chain), 1, np.random.default_rng(0))


def test_one_path_among_others_gets_what_it_gets_alone(follower):
    chain = follower.chain
    paths = [lifted(chain, 12), lifted(chain, 20, by=(0.1, 0.0, -0.05))]
    together = follower.rollouts(paths, holding(chain), 3, np.random.default_rng(2))
    alone = follower.rollout(paths[0], holding(chain), 3, np.random.default_rng(2))
    assert isinstance(together[0], Rollout)
    np.testing.assert_allclose(together[0].q, alone.q, atol=1e-9)
