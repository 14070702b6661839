from dataclasses import replace

import numpy as np
import pytest

from human import Chain, Subject, generate_model, motion_from_configurations
from prediction import (
    DemonstrationError,
    Demonstrations,
    demonstrations_from_motion,
    demonstrations_from_samples,
    find_reduction,
    join,
)


def test_hand_velocity_is_that_of_the_joints(planar, chain):
    _, demonstrations = planar
    dt = 1e-6
    q, qdot = demonstrations.q[:50], demonstrations.qdot[:50]
    after, _, _ = chain.forward_and_jacobian(q + dt * qdot)
    before, _, _ = chain.forward_and_jacobian(q - dt * qdot)
    np.testing.assert_allclose(demonstrations.xdot[:50], (after - before) / (2 * dt), atol=1e-8)


BROKEN = {
    "shape": (lambda d: {"qdot": d.qdot[:, :4]}, "qdot has shape"),
    "nan": (lambda d: {"q": np.where(np.arange(len(d))[:, None] == 7, np.nan, d.q)}, "sample 7"),
    "repeated": (lambda d: {"time_s": np.zeros(len(d))}, "does not increase"),
    "scattered": (lambda d: {"trajectory_id": np.arange(len(d)) % 2}, "stand together"),
    "no choice": (lambda d: {"jacobian": np.ones((len(d), 5, 5))}, "redundancy"),
    "rows": (lambda d: {"linear_rows": 3}, "linear_rows"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_malformed_demonstrations_are_refused_with_the_place(planar, case):
    change, words = BROKEN[case]
    with pytest.raises(DemonstrationError, match=words):
        replace(planar[1], **change(planar[1]))


def test_too_few_samples_are_refused(planar):
    with pytest.raises(DemonstrationError, match="at least 20"):
        planar[1].take(slice(0, 10)).check_enough()


def test_samples_of_the_wrong_width_or_with_gaps_are_refused(chain):
    with pytest.raises(DemonstrationError, match="expected"):
        demonstrations_from_samples(chain, np.zeros((4, 3)), np.zeros((4, 3)), np.arange(4))
    q = np.zeros((4, 5))
    q[2, 1] = np.inf
    with pytest.raises(DemonstrationError, match="sample 2"):
        demonstrations_from_samples(chain, q, np.zeros((4, 5)), np.arange(4))


def with_velocities(demonstrations: Demonstrations, qdot: np.ndarray) -> Demonstrations:
    return replace(demonstrations, qdot=qdot)


def test_locked_and_dependent_joints_are_dropped_and_follow(planar):
    demonstrations = planar[1]
    qdot = demonstrations.qdot.copy()
    qdot[:, 1] = 0.0
    qdot[:, 3] = 0.5 * qdot[:, 0] - 0.25 * qdot[:, 2]
    reduction = find_reduction(with_velocities(demonstrations, qdot), task_dim=2)
    assert len(reduction.kept) == 3
    assert "two" in reduction.dropped_names
    assert reduction.coupling("two") == {}
    np.testing.assert_allclose(qdot[:, reduction.kept] @ reduction.expansion.T, qdot, atol=1e-12)


def test_independent_joints_are_all_kept(planar):
    reduction = find_reduction(planar[1])
    assert reduction.dropped_names == ()
    np.testing.assert_array_equal(reduction.expansion, np.eye(5))


def test_reduced_demonstrations_keep_the_hand_velocity(planar):
    demonstrations = planar[1]
    qdot = demonstrations.qdot.copy()
    qdot[:, 4] = 0.3 * qdot[:, 0]
    demonstrations = with_velocities(demonstrations, qdot)
    reduction = find_reduction(demonstrations)
    reduced = demonstrations.reduced(reduction)
    assert reduced.joint_names == reduction.kept_names
    np.testing.assert_allclose(reduced.xdot, demonstrations.xdot, atol=1e-12)
    q = reduced.q[5]
    np.testing.assert_allclose(
        reduction.expand(q, demonstrations.q[5]), demonstrations.q[5], atol=1e-12
    )


def test_still_or_single_motion_demonstrations_are_refused(planar):
    demonstrations = planar[1]
    with pytest.raises(DemonstrationError, match="no joint moves"):
        find_reduction(with_velocities(demonstrations, np.zeros_like(demonstrations.qdot)))
    one = demonstrations.qdot[:, :1] * np.ones((1, 5))
    with pytest.raises(DemonstrationError, match="no choice of posture"):
        find_reduction(with_velocities(demonstrations, one))


def test_blocks_are_contiguous_disjoint_and_complete(planar):
    demonstrations = planar[1]
    one_take = replace(
        demonstrations,
        trajectory_id=np.zeros(len(demonstrations), dtype=int),
        time_s=np.arange(len(demonstrations)) * 0.05,
    )
    blocks = one_take.blocks(4)
    assert len(blocks) == 4
    np.testing.assert_array_equal(np.sum(blocks, axis=0), 1)
    for block in blocks:
        assert np.abs(np.diff(block.astype(int))).sum() <= 2
        assert 80 <= block.sum() <= 120


def test_blocks_keep_takes_whole():
    raw = np.repeat(np.arange(6), 10)
    demonstrations = Demonstrations(
        ("a", "b"),
        np.zeros((60, 2)),
        np.zeros((60, 2)),
        np.ones((60, 1, 2)),
        raw,
        np.tile(np.arange(10.0), 6),
        1,
    )
    for block in demonstrations.blocks(3):
        for take in range(6):
            assert block[raw == take].all() or not block[raw == take].any()


def test_thinning_keeps_every_take_and_the_bound(planar):
    thin = planar[1].thinned(100)
    assert len(thin) <= 100 + len(np.unique(planar[1].trajectory_id))
    assert set(thin.trajectory_id) == set(planar[1].trajectory_id)


def test_joined_takes_stay_apart(planar):
    both = join([planar[1], planar[1]])
    assert len(both) == 2 * len(planar[1])
    assert len(np.unique(both.trajectory_id)) == 2 * len(np.unique(planar[1].trajectory_id))
    with pytest.raises(DemonstrationError, match="at least one"):
        join([])


def test_frames_whose_velocity_was_not_measured_teach_nothing():
    model = generate_model(Subject(1.75, 75.0, "male"))
    time = np.concatenate([np.arange(40) * 0.02, [3.0], 6.0 + np.arange(40) * 0.02])
    q = np.tile(model.neutral(), (len(time), 1))
    moving = 7 + model.dof_names.index("jRightElbow_rotz")
    q[:, moving] = 0.5 * time
    motion = motion_from_configurations(model.dof_names, time, q)
    assert motion.v[40, moving - 1] == 0.0  # a lone frame: nothing to differentiate
    found = demonstrations_from_motion(Chain(model), motion)
    assert 3.0 not in found.time_s and len(found) == 80
    column = found.joint_names.index("jRightElbow_rotz")
    np.testing.assert_allclose(found.qdot[:, column], 0.5, atol=1e-9)
    alone = motion_from_configurations(model.dof_names, np.array([0.0, 1.0, 9.0]), q[:3])
    with pytest.raises(DemonstrationError, match="gaps"):
        demonstrations_from_motion(Chain(model), alone)
