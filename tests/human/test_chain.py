import numpy as np
import pinocchio as pin
import pytest

from human import (
    Chain,
    ConfigurationError,
    UnknownNameError,
    forward_kinematics,
    frame_poses,
)


@pytest.fixture(
    params=[("RightHandCOM", "Pelvis"), ("LeftHand", "T8"), ("RightToe", "Pelvis"), ("Head", "L3")],
    ids=lambda pair: f"{pair[1]}-{pair[0]}",
)
def chain(request, model):
    tip, base = request.param
    return Chain(model, tip=tip, base=base)


def test_right_hand_chain_has_the_24_published_degrees_of_freedom(model):
    chain = Chain(model)
    assert chain.n == 24
    assert chain.dof_names[0] == "jL5S1_rotx"
    assert chain.dof_names[-1] == "jRightWrist_rotz"
    assert tuple(model.dof_names[k] for k in chain.dof_indices) == chain.dof_names
    np.testing.assert_array_equal(chain.upper, model.upper[chain.dof_indices])


def test_equals_pinocchio(model, chain, rng):
    peer = model.pinocchio()
    data = peer.createData()
    q_chain = rng.uniform(-3.0, 3.0, (50, chain.n))
    position, rotation, jacobian = chain.forward_and_jacobian(q_chain)
    tip, base = peer.getFrameId(chain.tip), peer.getFrameId(chain.base)
    columns = 6 + chain.dof_indices
    for row in range(len(q_chain)):
        q = model.neutral()
        q[7 + chain.dof_indices] = q_chain[row]
        pin.computeJointJacobians(peer, data, q)
        pin.updateFramePlacements(peer, data)
        between = data.oMf[base].actInv(data.oMf[tip])
        turned = data.oMf[base].rotation.T
        full = pin.getFrameJacobian(peer, data, tip, pin.LOCAL_WORLD_ALIGNED)[:, columns]
        expected = np.concatenate([turned @ full[:3], turned @ full[3:]])
        np.testing.assert_allclose(position[row], between.translation, atol=1e-12)
        np.testing.assert_allclose(rotation[row], between.rotation, atol=1e-12)
        np.testing.assert_allclose(jacobian[row], expected, atol=1e-12)


def test_jacobian_is_the_derivative(chain, rng):
    q = rng.uniform(-1.0, 1.0, chain.n)
    jacobian = chain.jacobian(q)
    step = 1e-6
    for k in range(chain.n):
        ahead, behind = q.copy(), q.copy()
        ahead[k] += step
        behind[k] -= step
        (p1, r1), (p0, r0) = chain.forward(ahead), chain.forward(behind)
        np.testing.assert_allclose(jacobian[:3, k], (p1 - p0) / (2 * step), atol=1e-9)
        turn = pin.log3(r1 @ r0.T) / (2 * step)
        np.testing.assert_allclose(jacobian[3:, k], turn, atol=1e-8)


def test_forward_alone_and_batch_last_agree(chain, rng):
    q = rng.uniform(-3.0, 3.0, (4, 5, chain.n))
    position, rotation, jacobian = chain.forward_and_jacobian(q)
    assert jacobian.shape == (4, 5, 6, chain.n)
    assert jacobian.flags.c_contiguous
    alone = chain.forward(q)
    np.testing.assert_array_equal(alone[0], position)
    np.testing.assert_array_equal(alone[1], rotation)
    np.testing.assert_array_equal(chain.jacobian(q), jacobian)
    last = chain.sweep(np.ascontiguousarray(q.reshape(20, -1).T))
    np.testing.assert_array_equal(last[0].T.reshape(position.shape), position)
    np.testing.assert_array_equal(np.moveaxis(last[1], -1, 0).reshape(rotation.shape), rotation)
    np.testing.assert_array_equal(np.moveaxis(last[2], -1, 0).reshape(jacobian.shape), jacobian)


def test_one_posture(chain):
    position, rotation = chain.forward(np.zeros(chain.n))
    assert position.shape == (3,)
    np.testing.assert_array_equal(rotation, np.eye(3))


def test_what_is_no_chain_is_refused(model):
    with pytest.raises(UnknownNameError, match="Elbow"):
        Chain(model, tip="RightHandCOM", base="Elbow")
    with pytest.raises(UnknownNameError, match="Tail"):
        Chain(model, tip="Tail")
    with pytest.raises(ConfigurationError, match="at least one"):
        Chain(model, ())
    with pytest.raises(ConfigurationError, match="of its own"):
        Chain(model, ("RightHandCOM", "RightHand"))


BOTH = ("RightHandCOM", "LeftHandCOM")
SEVERAL = {
    "both hands": (BOTH, "Pelvis", (), 36),
    "right hand, feet fixed": ("RightHandCOM", "RightFoot", ("LeftFoot",), 42),
    "left hand, feet fixed": ("LeftHandCOM", "LeftFoot", ("RightFoot",), 42),
    "both hands, feet fixed": (BOTH, "RightFoot", ("LeftFoot",), 54),
    "hand to hand": ("RightHandCOM", "LeftHand", (), 24),
    "a tip on the way to another": ("RightHandCOM", "LeftFoot", ("Pelvis",), 33),
}


@pytest.fixture(params=SEVERAL)
def branched(request, model):
    tip, base, held, size = SEVERAL[request.param]
    chain = Chain(model, tip, base, held)
    assert chain.n == len(set(chain.dof_names)) == size
    return chain


def test_from_any_base_all_tips_are_where_the_whole_body_has_them(branched, rng):
    model = branched.model
    q = np.tile(model.neutral(), (6, 1))
    q[:, 7:] = rng.uniform(-1.5, 1.5, (6, 66))
    position, rotation = branched.forward(q[:, 7:][:, branched.dof_indices])
    poses = forward_kinematics(model, q)
    turn, origin = frame_poses(model, poses, branched.base)
    for k, tip in enumerate(branched.tips):
        tip_turn, tip_origin = frame_poses(model, poses, tip)
        seen = np.einsum("bji,bj->bi", turn, tip_origin - origin)
        np.testing.assert_allclose(position[:, 3 * k : 3 * k + 3], seen, atol=1e-12)
        stacked = rotation.reshape(6, -1, 3, 3)[:, k]
        np.testing.assert_allclose(stacked, np.swapaxes(turn, 1, 2) @ tip_turn, atol=1e-12)


def test_jacobian_of_several_tips_is_the_derivative(branched, rng):
    """Linear rows tip by tip, then angular ones; joints not on the way to a tip leave it alone."""
    q, step, tips = rng.uniform(-1.0, 1.0, branched.n), 1e-6, len(branched.tips)
    jacobian = branched.jacobian(q)
    assert jacobian.shape == (6 * tips, branched.n)
    for k in range(branched.n):
        ends = q + step * np.array([[1.0], [-1.0]]) * (np.arange(branched.n) == k)
        position, rotation = branched.forward(ends)
        slope = (position[0] - position[1]) / (2 * step)
        np.testing.assert_allclose(jacobian[: 3 * tips, k], slope, atol=1e-9)
        rotation = rotation.reshape(2, tips, 3, 3)
        turns = [pin.log3(a @ b.T) / (2 * step) for a, b in zip(*rotation, strict=True)]
        np.testing.assert_allclose(jacobian[3 * tips :, k], np.concatenate(turns), atol=1e-8)


def test_the_way_back_is_the_inverse(model, rng):
    out, back = Chain(model, "RightFoot", "Pelvis"), Chain(model, "Pelvis", "RightFoot")
    assert out.dof_names == back.dof_names[::-1]
    q = rng.uniform(-1.5, 1.5, (5, out.n))
    (position, rotation), (behind, turned) = out.forward(q), back.forward(q[:, ::-1])
    np.testing.assert_allclose(rotation @ turned, np.broadcast_to(np.eye(3), (5, 3, 3)), atol=1e-12)
    np.testing.assert_allclose((rotation @ behind[..., None])[..., 0], -position, atol=1e-12)


def test_batch_last_of_several_tips_agrees(branched, rng):
    q = rng.uniform(-1.0, 1.0, (4, branched.n))
    position, rotation, jacobian = branched.forward_and_jacobian(q)
    last = branched.sweep(np.ascontiguousarray(q.T))
    np.testing.assert_array_equal(last[0].T, position)
    np.testing.assert_array_equal(np.moveaxis(last[1], -1, 0), rotation)
    np.testing.assert_array_equal(np.moveaxis(last[2], -1, 0), jacobian)


def test_malformed_angles_are_refused(model):
    chain = Chain(model)
    with pytest.raises(ConfigurationError, match=r"\(\.\.\., 24\)"):
        chain.forward(np.zeros(66))
    with pytest.raises(ConfigurationError, match="finite"):
        chain.forward(np.full(24, np.nan))
