"""The compiled kernel against numpy, and how it is kept and found."""

import os
from dataclasses import replace

import numpy as np
import pytest

from estimation import (
    APPLICATION,
    Accelerometer,
    AngularAcceleration,
    CovarianceError,
    EstimationTree,
    ForceTorque,
    FreeWrench,
    JointAcceleration,
    KernelMissingError,
    MeasurementError,
    ModelCovariances,
    compile_kernel,
    estimate,
    hinge_tree,
    kernel_state,
    real_tree,
)
from estimation.cross_covariance import wrench_covariance
from estimation.elimination import sweep_down, sweep_down_spreads, sweep_up
from estimation.kernel import Call, loaded_kernel, machine_code, results, tables
from estimation.kernel.layout import (
    GLOBAL,
    GLOBAL_SIZE,
    LINK_CONSTANTS,
    LINK_CONSTANTS_SIZE,
    LINK_ROW,
)
from estimation.kernel.whole import kernel_code
from estimation.spatial import spatial_inertia
from estimation.tree_kinematics import tree_kinematics

from .balanced_scene import balanced, random_motion
from .test_elimination import random_run

MEANS = (
    "link_acceleration",
    "external_wrench",
    "joint_wrench",
    "joint_acceleration",
    "torque",
    "link_rotation",
    "residual",
    "residual_chi2",
)
SPREADS = (
    "link_acceleration_sd",
    "external_wrench_sd",
    "joint_wrench_sd",
    "joint_acceleration_sd",
    "torque_sd",
)


@pytest.fixture(scope="module", autouse=True)
def kernel():
    assert compile_kernel().ready
    return loaded_kernel()


def as_sensors(problem, monkeypatch):
    """Any Gaussian problem as readings, and the kernel's tables for it."""
    tree, frames = problem.tree, problem.s_hat.shape[0]
    own = [0] * tree.n_links

    def numbers_of(tree, measurements, covariances, frames, numbers, links, _):
        rows, none = [], numbers.same(np.zeros(18))
        for link in range(tree.n_links):
            links[link, LINK_ROW["information"]] = numbers.refer(problem.J[link])
            for half in (0, 3):
                weight = np.zeros((6, 3))
                weight[half : half + 3] = np.eye(3)
                value = numbers.own(problem.j[link][:, half : half + 3])
                rows.append([numbers.same(weight), none, none, value])
            own[link] = len(rows)
        links[:, LINK_ROW["last_sensor"]] = own
        links[1:, LINK_ROW["first_sensor"]] = own[:-1]
        return np.array(rows, dtype=np.int64)

    def wrenches_of(tree, measurements, covariances, frames, numbers, links, _):
        for link in range(tree.n_links):
            links[link, LINK_ROW["wrench_covariance"]] = numbers.refer(problem.Px[link])
            links[link, LINK_ROW["wrench"]] = numbers.own(problem.fbar[link])
        return np.zeros((0, 4), dtype=np.int64)

    variance = np.ones((frames, tree.n_dof))
    for dofs, block in zip(tree.dofs, problem.Gs, strict=True):
        variance[:, dofs] = block
    module = "estimation.kernel.sensor_tables"
    monkeypatch.setattr(f"{module}._motion_sensors", numbers_of)
    monkeypatch.setattr(f"{module}._wrenches", wrenches_of)
    monkeypatch.setattr(f"{module}.joint_information", lambda *_: (variance, problem.s_hat))
    finite = problem.Sf is not None
    model = ModelCovariances(
        joint_wrench_prior=1.0 if finite else float("inf"), prior_mean=problem.mu
    )
    sites = tree.link_names[-3:]
    made = tables(tree, [], model, frames, sites, True)
    constants = made.constants.copy()
    constants[GLOBAL["information_mean"]] = 0.0
    if finite:
        constants[GLOBAL["joint_wrench_prior"] :][:36] = problem.Sf.ravel()
    rows = constants[GLOBAL_SIZE : GLOBAL_SIZE + tree.n_links * LINK_CONSTANTS_SIZE]
    rows = rows.reshape(tree.n_links, -1)
    for name, blocks in (
        ("dynamics", problem.dynamics),
        ("kinematic_inverse", np.linalg.inv(problem.kinematic)),
    ):
        flat = np.reshape(blocks, (tree.n_links, -1))
        rows[:, LINK_CONSTANTS[name] :][:, : flat.shape[1]] = flat
    return replace(made, constants=constants), sites


@pytest.mark.parametrize("finite", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_random_trees_with_full_blocks(seed, finite, kernel, monkeypatch):
    rng = np.random.default_rng(seed)
    frames = int(rng.integers(1, 20))
    problem, q, v = random_run(rng, int(rng.integers(6, 14)), finite, frames)
    made, sites = as_sensors(problem, monkeypatch)
    call = Call(kernel, problem.tree, made, frames)
    call.state(q, v)
    for start, array in zip(made.starts, made.by_frame, strict=True):
        call.row[:, start : start + array.shape[1]] = array
    found = results(problem.tree, frames, len(sites), True)
    call.run(found, 0, frames)
    gains, root = sweep_up(problem)
    means = sweep_down(problem, gains, root)
    spreads = sweep_down_spreads(problem, gains, root)
    links = [problem.tree.link_names.index(name) for name in sites]
    sd = {
        "link_acceleration_sd": spreads.Ca,
        "external_wrench_sd": spreads.Cfx,
        "joint_wrench_sd": spreads.Cfj[1:],
    }
    expected = {
        "link_acceleration": means.a.swapaxes(0, 1),
        "external_wrench": means.fx.swapaxes(0, 1),
        "joint_wrench": means.fj[1:].swapaxes(0, 1),
        "joint_acceleration": means.s,
        "torque": means.tau,
        "residual": root.residual,
        "joint_acceleration_sd": np.sqrt(spreads.s),
        "torque_sd": np.sqrt(spreads.tau),
        "joint_moment_covariance": spreads.Cfj[1:, :, 3:, 3:].swapaxes(0, 1),
        "site_covariance": wrench_covariance(problem, gains, spreads, links),
    } | {
        name: np.sqrt(np.diagonal(block, axis1=-2, axis2=-1)).swapaxes(0, 1)
        for name, block in sd.items()
    }
    for name, value in expected.items():
        scale = np.abs(value).max() if value.size else 1.0
        np.testing.assert_allclose(found[name], value, rtol=1e-9, atol=1e-10 * scale, err_msg=name)


@pytest.fixture(scope="module")
def scene(person):
    rng = np.random.default_rng(17)
    return balanced(person, *random_motion(person, rng, 21), rng)


def on_a_plate(person, scene):
    """The readings with one foot on a plate that turns, and noise that changes as time goes by."""
    tree, rng = real_tree(person), np.random.default_rng(3)
    kinematics = tree_kinematics(tree, scene.q, scene.v)
    out = [FreeWrench("LeftHandCOM", 20.0, 0.5)]
    for sensor in scene.noisy(rng):
        if isinstance(sensor, FreeWrench):
            sensor = replace(sensor, force_sd=20.0)
        elif isinstance(sensor, ForceTorque) and sensor.link == "RightFoot":
            turned = np.linalg.qr(rng.normal(size=(21, 3, 3)))[0]
            turned *= np.linalg.det(turned)[:, None, None]
            place = kinematics.position[tree.link_names.index("RightFoot")] + 0.1
            half = 0.2 * rng.normal(size=(21, 6, 6))
            noise = half @ half.swapaxes(-1, -2) + np.eye(6)
            sensor = ForceTorque("RightFoot", sensor.value, noise, place, turned, "world")
        elif isinstance(sensor, Accelerometer) and sensor.link == "Head":
            noise = np.eye(3) * rng.uniform(1e-3, 1.0, (21, 1, 1))
            turned = np.linalg.qr(rng.normal(size=(21, 3, 3)))[0]
            turned *= np.linalg.det(turned)[:, None, None]
            sensor = replace(sensor, covariance=noise, rotation=turned)
        elif isinstance(sensor, JointAcceleration):
            sensor = replace(sensor, covariance=rng.uniform(1e-3, 1e-2, sensor.value.shape))
        out.append(sensor)
    return out


@pytest.mark.parametrize("links", [real_tree, hinge_tree])
@pytest.mark.parametrize("model", [ModelCovariances(), APPLICATION.covariances])
def test_both_engines_give_a_persons_numbers(person, scene, links, model):
    sensors, tree = on_a_plate(person, scene), links(person)
    found, expected = (
        estimate(tree, scene.q, scene.v, scene.a, sensors, covariances=model, engine=engine)
        for engine in ("kernel", "numpy")
    )
    assert (found.engine, expected.engine) == ("kernel", "numpy")
    for name in (*MEANS, *SPREADS, "site_covariance", "site_prior"):
        value = getattr(expected, name)
        loss = 1e-10 if name in MEANS else 1e-9
        scale = np.abs(value).max(axis=tuple(range(value.ndim - 1)))
        off = np.abs(getattr(found, name) - value)
        assert np.all(off <= loss * np.maximum(scale, 1e-3)), (name, (off / scale).max())


def test_means_alone_are_the_same_means(person, scene):
    sensors = on_a_plate(person, scene)
    run = (real_tree(person), scene.q, scene.v, scene.a, sensors)
    whole, means = (estimate(*run, spreads=spreads, engine="kernel") for spreads in (True, False))
    for name in MEANS:
        np.testing.assert_array_equal(getattr(means, name), getattr(whole, name))
    assert means.torque_sd is None


def test_what_the_kernel_doubts_numpy_refuses_by_name(person, scene):
    kept = [s for s in scene.sensors if not isinstance(s, Accelerometer)]
    loose = [*kept, Accelerometer("Pelvis", scene.sensors[2].value, 1e14)]
    model = ModelCovariances(acceleration_prior=1e300)
    tree = real_tree(person)
    for engine in ("numpy", "kernel"):
        with pytest.raises(CovarianceError, match="expected a positive variance"):
            estimate(tree, scene.q, scene.v, None, loose, covariances=model, engine=engine)


@pytest.fixture
def elsewhere(monkeypatch, tmp_path):
    """A machine on which nothing has been compiled."""
    folders = (tmp_path / "closed" / "kernels", tmp_path / "own")
    (tmp_path / "closed").write_text("a file where a folder should be")
    monkeypatch.setattr(machine_code, "folders", lambda: folders)
    monkeypatch.setattr(machine_code, "_loaded", machine_code._Loaded())
    return folders[1]


def test_without_a_kernel_numpy_works_and_nothing_is_compiled(
    elsewhere, monkeypatch, person, scene
):
    monkeypatch.setattr(machine_code, "_compiled", lambda: pytest.fail("compiled unasked"))
    run = (real_tree(person), scene.q, scene.v, scene.a, scene.sensors)
    assert estimate(*run).engine == "numpy"
    state = kernel_state()
    assert not state.ready
    assert "compile_kernel()" in state.reason
    with pytest.raises(KernelMissingError, match=r"compile_kernel\(\)"):
        estimate(*run, engine="kernel")


def test_a_kernel_is_compiled_once_and_found_by_the_next_process(elsewhere, monkeypatch):
    state = compile_kernel()
    assert state.ready
    assert state.path is not None
    assert state.path.parent == elsewhere
    monkeypatch.setattr(machine_code, "_compiled", lambda: pytest.fail("compiled again"))
    monkeypatch.setattr(machine_code, "_loaded", machine_code._Loaded())
    assert compile_kernel().reason == f"loaded from {state.path}"
    # Half a file, as a full disk leaves it, is no kernel.
    state.path.write_bytes(state.path.read_bytes()[:-100])
    monkeypatch.setattr(machine_code, "_loaded", machine_code._Loaded())
    assert not kernel_state().ready


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda path: path.chmod(0o666), "others may write it"),
        (lambda path: os.chown(path, 12345, -1), "it belongs to user 12345"),
    ],
)
def test_nobody_elses_code_is_run(elsewhere, monkeypatch, change, why):
    path = compile_kernel().path
    try:
        change(path)
    except PermissionError:
        # Only the administrator gives files away; to others the file's owner is the stranger.
        monkeypatch.setattr(os, "geteuid", lambda: 54321)
        why = "it belongs to user"
        monkeypatch.setattr(machine_code, "_package_owner", lambda: 54321)
    monkeypatch.setattr(machine_code, "_loaded", machine_code._Loaded())
    monkeypatch.setattr(machine_code, "_take", lambda code: pytest.fail("was loaded"))
    state = kernel_state()
    assert not state.ready
    assert why in state.reason


def test_another_versions_kernel_under_this_ones_name_is_not_run(elsewhere, monkeypatch):
    path = compile_kernel().path
    other = "kernel-of-another-version.bin"
    path.rename(path.with_name(other))
    monkeypatch.setattr(machine_code, "_file_name", lambda: other)
    monkeypatch.setattr(machine_code, "_loaded", machine_code._Loaded())
    assert not kernel_state().ready


def test_a_process_that_an_upgrade_overtook_compiles_nothing(elsewhere, monkeypatch):
    monkeypatch.setattr(machine_code, "_sources", lambda: b"those of the next version")
    monkeypatch.setattr(machine_code, "_compiled", lambda: pytest.fail("compiled"))
    state = compile_kernel()
    assert not state.ready
    assert "start it again" in state.reason


def test_where_nothing_can_be_kept_the_kernel_serves_this_process(elsewhere, monkeypatch, tmp_path):
    monkeypatch.setattr(machine_code, "folders", lambda: (tmp_path / "closed" / "kernels",))
    state = compile_kernel()
    assert state.ready
    assert state.path is None
    assert "not kept" in state.reason


@pytest.mark.parametrize("wide", [False, True])
def test_the_kernel_calls_nothing_outside_itself(wide):
    text = kernel_code(wide)
    declared = [line for line in text.splitlines() if line.startswith("declare")]
    assert declared
    assert all('@"llvm.' in line for line in declared)


def test_frames_that_the_kernel_doubts_are_done_again_by_numpy(person, scene, monkeypatch):
    run = (real_tree(person), scene.q, scene.v, scene.a, on_a_plate(person, scene))
    whole = estimate(*run, engine="kernel")
    plain = estimate(*run, engine="numpy")
    doubted = np.array([2, 11])
    monkeypatch.setattr("estimation.kernel.batch.doubtful", lambda status: doubted)
    mixed = estimate(*run, engine="kernel")
    for name in (*MEANS, *SPREADS, "site_covariance", "site_prior"):
        expected = getattr(whole, name).copy()
        expected[doubted] = getattr(plain, name)[doubted]
        np.testing.assert_allclose(getattr(mixed, name), expected, rtol=1e-12, atol=1e-12)
        found = np.delete(getattr(mixed, name), doubted, axis=0)
        np.testing.assert_array_equal(found, np.delete(getattr(whole, name), doubted, axis=0))


@pytest.mark.parametrize("engine", ["kernel", "numpy"])
@pytest.mark.parametrize("method", ["one_step", "two_step", "deterministic"])
def test_a_frame_beyond_double_precision_is_named(person, scene, engine, method):
    v = scene.v.copy()
    v[11] = 1e200
    joints = replace(scene.sensors[0], value=scene.sensors[0].value.copy())
    joints.value[3] = np.nan
    sensors = [joints, *scene.sensors[1:]]
    run = (real_tree(person), scene.q, v, scene.a, sensors)
    with pytest.raises(MeasurementError, match="double precision") as refused:
        estimate(*run, method=method, engine=engine, missing="leave_out")
    assert refused.value.frames == (11,)


def test_one_sensor_is_not_surer_in_one_direction_than_digits_go(person, scene):
    uneven = ForceTorque("LeftFoot", np.zeros((21, 6)), [1e-10, 1e8, 1.0, 1.0, 1.0, 1.0])
    with pytest.raises(CovarianceError, match="times as large"):
        estimate(real_tree(person), scene.q, scene.v, scene.a, [*scene.sensors, uneven])


@pytest.mark.parametrize("variance", [1e4, 1e6])
def test_joints_all_but_unknown_cost_no_digits(variance):
    # Two axes a joint, turned: in the link's axes what they leave sure is buried in what is loose.
    rng = np.random.default_rng(0)
    body = spatial_inertia(3.0, np.array([0.1, 0.2, 0.05]), 0.02 * np.eye(3))
    tree = EstimationTree(
        link_names=("trunk", "arm", "hand"),
        joint_names=("shoulder", "wrist"),
        parents=(-1, 0, 1),
        offsets=np.array([[0.0, 0.0, 0.0], [0.1, 0.2, 0.3], [0.3, 0.1, 0.0]]),
        axes=((), (0, 1), (1, 2)),
        dofs=(np.arange(0), np.arange(2), np.arange(2, 4)),
        inertias=np.array([body] * 3),
        dof_names=("a", "b", "c", "d"),
    )
    q, v = rng.normal(size=(4, 11)), rng.normal(size=(4, 10))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    sensors = [
        Accelerometer("trunk", rng.normal(size=(4, 3)), 1e-3),
        AngularAcceleration("trunk", rng.normal(size=(4, 3)), 1e-2),
        Accelerometer("hand", rng.normal(size=(4, 3)), 1e-3, (0.1, 0.1, 0.1)),
        JointAcceleration(rng.normal(size=(4, 4)), variance),
        FreeWrench("trunk", 100.0, 100.0),
    ]
    found, expected = (
        estimate(tree, q, v, None, sensors, engine=engine) for engine in ("kernel", "numpy")
    )
    for name in ("torque", "joint_acceleration", "link_acceleration"):
        sd = getattr(expected, f"{name}_sd")
        off = np.abs(getattr(found, name) - getattr(expected, name))
        assert np.all(off <= 1e-5 * sd), name
        np.testing.assert_allclose(getattr(found, f"{name}_sd"), sd, rtol=1e-6)
