"""The recursion against the same problem written down whole and solved by QR."""

import numpy as np
import pytest

from estimation import CovarianceError, EstimationTree, ModelCovariances, hinge_tree, real_tree
from estimation.cross_covariance import wrench_covariance
from estimation.elimination import sweep_down, sweep_down_spreads, sweep_up
from estimation.problem import Problem, assemble
from estimation.spatial import spatial_inertia
from estimation.tree_kinematics import tree_kinematics

from .balanced_scene import balanced, random_motion
from .dense_reference import solve


def random_tree(rng, links):
    """Any tree: joints of none to three axes in any order, every fourth link massless."""
    axes, dofs, at = [()], [np.array([], dtype=np.intp)], 0
    for _ in range(links - 1):
        k = int(rng.integers(0, 4))
        axes.append(tuple(int(axis) for axis in rng.permutation(3)[:k]))
        dofs.append(np.arange(at, at + k, dtype=np.intp))
        at += k
    inertias = np.zeros((links, 6, 6))
    for link in range(links):
        if link % 4 != 3:
            half = rng.normal(size=(3, 3)) * 0.2
            inertias[link] = spatial_inertia(
                rng.uniform(0.5, 10.0), rng.normal(size=3) * 0.1, half @ half.T + 0.01 * np.eye(3)
            )
    return EstimationTree(
        link_names=tuple(f"link{k}" for k in range(links)),
        joint_names=tuple(f"joint{k}" for k in range(1, links)),
        parents=(-1, *(int(rng.integers(0, k)) for k in range(1, links))),
        offsets=np.vstack([np.zeros(3), rng.normal(size=(links - 1, 3)) * 0.3]),
        axes=tuple(axes),
        dofs=tuple(dofs),
        inertias=inertias,
        dof_names=tuple(f"dof{k}" for k in range(at)),
    )


def random_problem(rng, links, finite, frames=3):
    """Full covariance blocks everywhere, some constant and some of each frame."""
    return random_run(rng, links, finite, frames)[0]


def random_run(rng, links, finite, frames):
    """The same with the state that its kinematics come from."""
    tree = random_tree(rng, links)
    q = rng.normal(size=(frames, 7 + tree.n_dof))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    v = rng.normal(size=(frames, 6 + tree.n_dof))
    kinematics = tree_kinematics(tree, q, v)

    def block(scale, count=1):
        half = rng.normal(size=(count, 6, 6))
        return scale * (half @ half.swapaxes(-1, -2) + 0.5 * np.eye(6))

    counts = [int(rng.choice([1, frames])) for _ in range(links)]
    problem = Problem(
        tree=tree,
        kinematics=kinematics,
        J=[block(1.0, count) for count in counts],
        j=rng.normal(size=(links, frames, 6)),
        Px=[block(rng.choice([1e-2, 10.0]), count) for count in counts],
        fbar=rng.normal(size=(links, frames, 6)),
        dynamics=[block(1e-2)[0] for _ in range(links)],
        kinematic=[block(1e-2)[0] for _ in range(links)],
        Gs=[
            rng.uniform(0.1, 2.0, (count, len(dofs)))
            for count, dofs in zip(counts, tree.dofs, strict=True)
        ],
        s_hat=rng.normal(size=(frames, tree.n_dof)),
        Sf=block(5.0)[0] if finite else None,
        mu=0.3,
        hinge=[np.zeros((6, 6))] * links,
    )
    return problem, q, v


def assert_equal_to_dense(problem, frame, d_atol, relative):
    """Every mean, standard deviation and torque of a frame, and three cross-covariances."""
    tree = problem.tree
    gains, root = sweep_up(problem)
    means = sweep_down(problem, gains, root)
    spreads = sweep_down_spreads(problem, gains, root)
    dense = solve(problem, frame)
    for kind, mean, block in (
        ("a", means.a, spreads.Ca),
        ("fx", means.fx, spreads.Cfx),
        ("fj", means.fj, spreads.Cfj),
    ):
        for link in range(1 if kind == "fj" else 0, tree.n_links):
            part = dense.where[kind, link]
            np.testing.assert_allclose(mean[link, frame], dense.mean[part], rtol=0, atol=d_atol)
            true = dense.covariance[part, part]
            scale = np.sqrt(np.diagonal(true))
            error = (block[link, frame] - true) / (scale[:, None] * scale[None, :])
            assert np.abs(error).max() < relative, (kind, tree.link_names[link])
    for link in range(1, tree.n_links):
        part, H = dense.where["fj", link], problem.kinematics.H[link][frame]
        tau = H.T @ dense.mean[part]
        variance = np.diagonal(H.T @ dense.covariance[part, part] @ H)
        dofs = tree.dofs[link]
        np.testing.assert_allclose(means.tau[frame, dofs], tau, rtol=0, atol=d_atol)
        np.testing.assert_allclose(spreads.tau[frame, dofs], variance, rtol=2 * relative)
    for dof in range(tree.n_dof):
        part = dense.where["s", dof]
        np.testing.assert_allclose(means.s[frame, [dof]], dense.mean[part], rtol=0, atol=d_atol)
        true = dense.covariance[part, part][0]
        np.testing.assert_allclose(spreads.s[frame, [dof]], true, rtol=2 * relative)
    links = [0, tree.n_links // 2, tree.n_links - 1, tree.parents[-1] or 1]
    links = list(dict.fromkeys(links))
    found = wrench_covariance(problem, gains, spreads, links)[frame]
    index = np.concatenate([np.r_[dense.where["fx", link]] for link in links])
    true = dense.covariance[np.ix_(index, index)]
    scale = np.sqrt(np.diagonal(true))
    assert np.abs((found - true) / np.outer(scale, scale)).max() < relative


@pytest.mark.parametrize("finite", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_random_trees_with_full_blocks(seed, finite):
    rng = np.random.default_rng(seed)
    problem = random_problem(rng, int(rng.integers(6, 14)), finite)
    assert_equal_to_dense(problem, int(rng.integers(3)), 1e-8, 1e-8)


def test_the_test_would_see_a_wrong_gain():
    problem = random_problem(np.random.default_rng(0), 8, False)
    problem.kinematic[3][0, 0] *= 1.001
    root = sweep_up(problem)[1]
    before = solve(problem, 0).mean[:6]
    problem.kinematic[3][0, 0] /= 1.001
    assert np.abs(root.a[0] - before).max() < 1e-9
    assert np.abs(sweep_up(problem)[1].a[0] - before).max() > 1e-9


@pytest.fixture(scope="module")
def scene(person):
    rng = np.random.default_rng(8)
    return balanced(person, *random_motion(person, rng, 2), rng)


PAPER = ModelCovariances(
    acceleration_prior=1e6,
    wrench_prior=1e6,
    joint_wrench_prior=1e6,
    joint_acceleration_prior=1e6,
    untouched_force_sd=1e-3,
    untouched_moment_sd=1e-3,
)


@pytest.mark.parametrize("covariances", [ModelCovariances(), PAPER], ids=["default", "paper"])
def test_the_person_with_the_papers_and_with_the_default_covariances(person, scene, covariances):
    tree = real_tree(person)
    kinematics = tree_kinematics(tree, scene.q, scene.v)
    readings = scene.noisy(np.random.default_rng(0))
    problem = assemble(tree, kinematics, readings, covariances, 2)
    # With a free force of 100 N; the papers' prior on joint wrenches costs digits beside it.
    relative = 1e-8 if covariances.joint_wrench_prior == np.inf else 1e-6
    assert_equal_to_dense(problem, 1, 1e-6, relative)


def test_the_67_links_of_the_papers(person, scene):
    tree = hinge_tree(person, frames=("RightHandCOM",))
    kinematics = tree_kinematics(tree, scene.q, scene.v)
    problem = assemble(tree, kinematics, scene.sensors, PAPER, 2)
    gains, root = sweep_up(problem)
    means = sweep_down(problem, gains, root)
    dense = solve(problem, 0, covariance=False)
    for kind, mean in (("a", means.a), ("fx", means.fx)):
        for link in range(tree.n_links):
            expected = dense.mean[dense.where[kind, link]]
            np.testing.assert_allclose(mean[link, 0], expected, rtol=0, atol=1e-6)
    for link in range(1, tree.n_links):
        expected = dense.mean[dense.where["fj", link]]
        np.testing.assert_allclose(means.fj[link, 0], expected, rtol=0, atol=1e-6)


def test_a_base_that_nothing_holds_is_refused():
    problem = random_problem(np.random.default_rng(1), 6, False)
    problem.J[:] = [np.zeros((1, 6, 6))] * 6
    problem.J[0] = np.diag([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])[None]
    with pytest.raises(CovarianceError, match="base acceleration"):
        sweep_up(problem)
