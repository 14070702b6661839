import numpy as np
import pinocchio as pin
import pytest

from human import Chain, ConfigurationError, UnknownNameError


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


def test_base_that_does_not_carry_the_tip_is_refused(model):
    with pytest.raises(UnknownNameError, match="carrying the tip"):
        Chain(model, tip="RightHandCOM", base="LeftHand")
    with pytest.raises(UnknownNameError, match="Tail"):
        Chain(model, tip="Tail")


def test_malformed_angles_are_refused(model):
    chain = Chain(model)
    with pytest.raises(ConfigurationError, match=r"\(\.\.\., 24\)"):
        chain.forward(np.zeros(66))
    with pytest.raises(ConfigurationError, match="finite"):
        chain.forward(np.full(24, np.nan))
