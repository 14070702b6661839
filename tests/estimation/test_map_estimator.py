from dataclasses import replace

import numpy as np
import pytest

from estimation import (
    APPLICATION,
    TPOSE_LOAD,
    TPOSE_NO_LOAD,
    Accelerometer,
    CovarianceError,
    ForceTorque,
    FreeWrench,
    JointAcceleration,
    MeasurementError,
    MissingMeasurementError,
    ModelCovariances,
    UnknownLinkError,
    estimate,
    hinge_tree,
    real_tree,
)
from estimation.momentum import momentum_rate, transforms_from_base
from estimation.ncwe import external_wrenches
from estimation.tree_kinematics import tree_kinematics
from human.rotations import (
    quaternion_multiply,
    quaternion_to_matrix,
    rotation_vector_to_quaternion,
)

from .balanced_scene import balanced, random_motion

#: Every unknown and equation as in the papers' table, for one step.
PAPER = APPLICATION.covariances
PAPER_SENSORS = {
    "Accelerometer": 1.1e-3,
    "AngularAcceleration": 1.1e-3,
    "JointAcceleration": 6.66e-6,
    "ForceTorque": 1e-6,
}


@pytest.fixture(scope="module")
def tree(person):
    return real_tree(person)


@pytest.fixture(scope="module")
def scene(person):
    rng = np.random.default_rng(17)
    return balanced(person, *random_motion(person, rng, 40), rng)


def run(tree, scene, sensors=None, **more):
    used = scene.sensors if sensors is None else sensors
    return estimate(tree, scene.q, scene.v, scene.a, used, **more)


def is_kinematic(sensor):
    return not isinstance(sensor, ForceTorque | FreeWrench)


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


def test_exact_readings_give_the_true_torques_and_the_load(tree, scene):
    found = run(tree, scene, scene.with_variances(**PAPER_SENSORS))
    assert rms(found.torque - scene.torque) <= 0.02
    load = found.external_wrench[:, found.link("RightHandCOM"), :3]
    np.testing.assert_allclose(load, scene.load, atol=0.1)
    assert found.bands == "uncertainty"
    assert found.assumed == ()
    assert found.sites == ("RightHandCOM",)


def test_intervals_cover_the_truth_as_often_as_they_say(tree, scene):
    rng = np.random.default_rng(5)
    inside, errors, chi2 = [], [], []
    used = {getattr(sensor, "link", "") for sensor in scene.sensors if not is_kinematic(sensor)}
    for _ in range(4):
        # What is taken to be untouched is touched as lightly as stated.
        touches = [
            ForceTorque(link, 1e-2 * rng.normal(size=(40, 6)), 1e-4)
            for link in tree.link_names
            if link not in used
        ]
        found = run(tree, scene, scene.noisy(rng) + touches)
        error = found.torque - scene.torque
        inside.append(np.abs(error) < 1.96 * found.torque_sd)
        errors.append(error)
        chi2.append(found.residual_chi2)
        load = found.external_wrench[:, found.link("RightHandCOM"), :3] - scene.load
        inside.append(np.abs(load) < 1.96 * found.external_wrench_sd[:, -2, :3])
    assert 0.92 < np.mean(inside[0::2]) < 0.97
    assert 0.92 < np.mean(inside[1::2]) < 0.98
    assert rms(errors) <= 0.35
    # The load's own prior takes three of the six degrees of freedom; its moment is known.
    assert 2.0 < np.mean(chi2) < 5.0


def test_the_residual_is_as_large_as_its_covariance_says(tree, scene):
    rng = np.random.default_rng(9)
    known = {sensor.link for sensor in scene.sensors if isinstance(sensor, ForceTorque)}
    hand = np.concatenate([scene.load, 0.0 * scene.load], axis=1)
    chi2 = []
    for _ in range(4):
        sensors = [s for s in scene.noisy(rng) if not isinstance(s, FreeWrench)]
        for link in set(tree.link_names) - known:
            value = 0.01 * rng.normal(size=(40, 6))
            value += hand if link == "RightHandCOM" else 0.0
            sensors.append(ForceTorque(link, value, 1e-4))
        chi2.append(run(tree, scene, sensors).residual_chi2)
    # Six degrees of freedom, 160 frames: the mean's standard deviation is 0.27.
    assert np.mean(chi2) == pytest.approx(6.0, abs=0.9)
    heavy = [replace(s, value=s.value + 5.0) if isinstance(s, ForceTorque) else s for s in sensors]
    assert np.mean(run(tree, scene, heavy).residual_chi2) > 50.0


def test_without_noise_sources_the_answer_is_inverse_dynamics(tree, scene):
    hand = ForceTorque(
        "RightHandCOM", np.concatenate([scene.load, 0.0 * scene.load], axis=1), 1e-10
    )
    known = [s for s in scene.sensors if not isinstance(s, FreeWrench)] + [hand]
    exact = run(tree, scene, known, method="deterministic")
    np.testing.assert_allclose(exact.torque, scene.torque, atol=1e-10)
    np.testing.assert_allclose(exact.residual, 0.0, atol=1e-10)
    assert exact.torque_sd is None
    assert exact.bands == "none"
    tight = ModelCovariances(
        dynamics=1e-10, kinematics=1e-10, untouched_force_sd=1e-5, untouched_moment_sd=1e-5
    )
    found = run(tree, scene, known, covariances=tight)
    np.testing.assert_allclose(found.torque, scene.torque, atol=1e-5)


def turned(scene, angle):
    """The scene walked around the world's vertical axis, plates and all."""
    turn = rotation_vector_to_quaternion(np.array([0.0, 0.0, angle]))
    R = quaternion_to_matrix(turn)
    q = scene.q.copy()
    q[:, :3] = q[:, :3] @ R.T
    q[:, 3:7] = quaternion_multiply(turn, q[:, 3:7])
    return replace(scene, q=q), R


def on_plates(tree, scene, R):
    """The same readings with each foot's from a plate in the world."""
    kinematics = tree_kinematics(tree, scene.q, scene.v)
    out = [s for s in scene.sensors if not isinstance(s, ForceTorque)]
    for sensor in scene.sensors:
        if isinstance(sensor, ForceTorque):
            link = tree.link_names.index(sensor.link)
            axes = kinematics.rotation[link] @ sensor.rotation
            place = kinematics.position[link] + kinematics.rotation[link] @ sensor.position
            plate, center = R @ np.diag([1.0, -1.0, -1.0]), R @ np.array([0.3, -0.2, 0.0])
            force = np.einsum("fij,fj->fi", axes, sensor.value[:, :3])
            moment = np.einsum("fij,fj->fi", axes, sensor.value[:, 3:])
            moment = moment + np.cross(place - center, force)
            value = np.concatenate([force @ plate, moment @ plate], axis=1)
            covariance = [2.0, 3.0, 4.0, 0.5, 0.6, 0.7]
            out.append(ForceTorque(sensor.link, value, covariance, center, plate, "world"))
    return out


@pytest.mark.parametrize("method", ["one_step", "two_step", "deterministic"])
def test_turning_the_whole_scene_changes_nothing(tree, scene, method):
    before = run(tree, scene, on_plates(tree, scene, np.eye(3)), method=method)
    around, R = turned(scene, 2.2)
    after = run(tree, around, on_plates(tree, around, R), method=method)
    for name in ("torque", "external_wrench", "joint_wrench", "torque_sd"):
        if getattr(before, name) is not None:
            np.testing.assert_allclose(
                getattr(after, name), getattr(before, name), rtol=1e-9, atol=1e-9
            )


def hand_known(scene):
    """The readings with the load measured too, as in the papers' second step."""
    wrench = np.concatenate([scene.load, 0.0 * scene.load], axis=1)
    kept = [s for s in scene.with_variances(**PAPER_SENSORS) if not isinstance(s, FreeWrench)]
    return [*kept, ForceTorque("RightHandCOM", wrench, 1e-6)]


def test_real_links_and_the_papers_67_agree_when_covariances_are_carried_over(person, scene):
    sensors = hand_known(scene)
    papers = run(hinge_tree(person), scene, sensors, covariances=PAPER)
    carried = replace(PAPER, joint_wrench_prior=float("inf"), carried_from_hinges=True)
    real = run(real_tree(person), scene, sensors, covariances=carried)
    np.testing.assert_allclose(real.torque, papers.torque, rtol=0, atol=1e-5)
    np.testing.assert_allclose(real.torque_sd, papers.torque_sd, rtol=1e-6)
    plain = run(
        real_tree(person), scene, sensors, covariances=replace(carried, carried_from_hinges=False)
    )
    assert np.abs(plain.torque_sd / papers.torque_sd - 1.0).max() > 0.05


def test_both_trees_are_one_problem_without_a_prior_on_joint_wrenches(person, scene):
    free = replace(PAPER, joint_wrench_prior=float("inf"))
    # Beside equations of 1e-3 N a freer force would leave its variance too few digits to compare.
    sensors = [
        FreeWrench(s.link, 10.0) if isinstance(s, FreeWrench) else s
        for s in scene.with_variances(**PAPER_SENSORS)
    ]
    papers = run(hinge_tree(person), scene, sensors, covariances=free)
    carried = replace(free, carried_from_hinges=True)
    real = run(real_tree(person), scene, sensors, covariances=carried)
    # What is left is the massless links' own prior on accelerations.
    np.testing.assert_allclose(real.torque, papers.torque, rtol=0, atol=1e-5)
    np.testing.assert_allclose(real.torque_sd, papers.torque_sd, rtol=1e-6)


def test_a_frame_alone_gives_what_the_whole_run_gave(tree, scene, monkeypatch):
    whole = run(tree, scene)
    one = np.array([23])
    alone = estimate(
        tree,
        scene.q[one],
        scene.v[one],
        scene.a[one],
        [s if isinstance(s, FreeWrench) else replace(s, value=s.value[one]) for s in scene.sensors],
    )
    np.testing.assert_allclose(alone.torque, whole.torque[one], rtol=0, atol=1e-12)
    np.testing.assert_allclose(alone.torque_sd, whole.torque_sd[one], rtol=1e-11)
    monkeypatch.setattr("estimation.kernel.batch.CHUNK", 7)
    parts = run(tree, scene)
    np.testing.assert_allclose(parts.torque, whole.torque, rtol=0, atol=1e-12)


def test_covariances_may_change_from_frame_to_frame(tree, scene):
    loose = np.ones((40, 3, 3)) * np.eye(3) * 0.033**2
    loose[20:] *= 100.0
    sensors = [
        replace(s, covariance=loose) if isinstance(s, Accelerometer) else s for s in scene.sensors
    ]
    before, after = run(tree, scene), run(tree, scene, sensors)
    np.testing.assert_allclose(after.torque_sd[:20], before.torque_sd[:20], rtol=1e-12)
    assert np.all(after.torque_sd[20:] >= before.torque_sd[20:])
    assert np.mean(after.torque_sd[20:] / before.torque_sd[20:]) > 1.05


@pytest.mark.parametrize("diagonal_at", ["com", "base"])
def test_step_one_solves_the_papers_problem(tree, scene, diagonal_at):
    rng = np.random.default_rng(2)
    kinematics = tree_kinematics(tree, scene.q[:2], scene.v[:2])
    half = rng.normal(size=(tree.n_links, 1, 6, 6))
    Px = list(half @ half.swapaxes(-1, -2) + np.eye(6))
    fbar, rate = rng.normal(size=(tree.n_links, 2, 6)), 10.0 * rng.normal(size=(2, 6))
    found, spread = external_wrenches(
        tree, kinematics, Px, fbar, rate, 0.3, diagonal_at=diagonal_at
    )
    X = transforms_from_base(kinematics)
    carry = np.eye(6)
    if diagonal_at == "com":
        centers = [
            kinematics.position[k, 1] + kinematics.rotation[k, 1] @ center_of(tree, k)
            for k in range(tree.n_links)
        ]
        masses = tree.inertias[:, 0, 0]
        center = masses @ np.array(centers) / masses.sum() - kinematics.position[0, 1]
        c = kinematics.rotation[0, 1].T @ center
        carry[3:, :3] = np.array([[0, -c[2], c[1]], [c[2], 0, -c[0]], [-c[1], c[0], 0]])
    noise = carry @ (0.3 * np.eye(6)) @ carry.T
    information = np.zeros((6 * tree.n_links,) * 2)
    for k in range(tree.n_links):
        information[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = np.linalg.inv(Px[k][0])
    Y = np.concatenate([X[k, 1].T for k in range(tree.n_links)], axis=1)
    vector = information @ fbar[:, 1].ravel() + Y.T @ np.linalg.solve(noise, rate[1])
    covariance = np.linalg.inv(information + Y.T @ np.linalg.solve(noise, Y))
    np.testing.assert_allclose(found[:, 1].ravel(), covariance @ vector, atol=1e-9)
    for k in range(tree.n_links):
        part = slice(6 * k, 6 * k + 6)
        np.testing.assert_allclose(spread[k, 1], covariance[part, part], atol=1e-9)


def center_of(tree, link):
    mass, lower = tree.inertias[link, 0, 0], tree.inertias[link, 3:, :3]
    return np.array([lower[2, 1], lower[0, 2], lower[1, 0]]) / mass if mass else np.zeros(3)


def test_all_external_wrenches_together_are_the_rate_of_change_of_momentum(tree, scene):
    found = run(tree, scene, method="deterministic")
    kinematics = tree_kinematics(tree, scene.q, scene.v)
    rate = momentum_rate(tree, kinematics, found.link_acceleration.swapaxes(0, 1))
    X = transforms_from_base(kinematics)
    wrench = found.external_wrench.copy()
    wrench[:, found.link("RightHandCOM"), :3] = scene.load
    total = np.einsum("kfji,fkj->fi", X, wrench)
    np.testing.assert_allclose(total, rate, atol=1e-9)
    # Weight alone, as some software has it, is far from it.
    still = estimate(tree, scene.q, None, 0.0 * scene.a, method="deterministic")
    assert np.abs(still.residual - rate).max() > 50.0


def test_the_papers_two_steps_find_the_load_and_call_their_bands_tuning(tree, scene):
    found = run(tree, scene, method="two_step", preset=TPOSE_LOAD)
    load = found.external_wrench[:, found.link("RightHandCOM"), :3]
    np.testing.assert_allclose(load, scene.load, atol=0.5)
    assert rms(found.torque - scene.torque) < 0.1
    assert found.bands == "tuning"
    noisy = run(tree, scene, scene.noisy(np.random.default_rng(1)), method="two_step")
    inside = np.abs(noisy.torque - scene.torque) < 1.96 * noisy.torque_sd
    assert np.mean(inside) < 0.5
    nothing = run(tree, scene, method="two_step", preset=TPOSE_NO_LOAD)
    assert np.abs(nothing.external_wrench[:, found.link("RightHandCOM")]).max() < 0.1


def test_accelerations_nobody_measured_are_derived_and_said_to_be(tree, scene):
    kept = [s for s in scene.sensors if isinstance(s, ForceTorque | FreeWrench)]
    found = run(tree, scene, kept)
    assert rms(found.torque - scene.torque) < 0.1
    assert len(found.assumed) == 3
    assert all("derived from the motion" in line for line in found.assumed)
    two = run(tree, scene, kept, method="two_step")
    assert rms(two.torque - scene.torque) < 0.5
    assert len(two.assumed) == 3
    with pytest.raises(MissingMeasurementError, match="never taken to be zero"):
        estimate(tree, scene.q, scene.v, None, kept)
    joints = [*kept, JointAcceleration(scene.a[:, 6:], 1.0)]
    with pytest.raises(MissingMeasurementError, match="free fall"):
        estimate(tree, scene.q, scene.v, None, joints)


@pytest.mark.parametrize("method", ["two_step", "deterministic"])
def test_the_other_methods_need_the_motions_accelerations(tree, scene, method):
    with pytest.raises(MissingMeasurementError, match=method):
        estimate(tree, scene.q, scene.v, None, scene.sensors, method=method)


def test_frames_that_are_not_finite_are_named_and_the_rest_estimated(tree, scene):
    sensors = list(scene.sensors)
    place = next(k for k, s in enumerate(sensors) if isinstance(s, Accelerometer))
    value = sensors[place].value.copy()
    value[[3, 8], 1] = np.nan
    value[30, 0] = np.inf
    sensors[place] = replace(sensors[place], value=value)
    with pytest.raises(
        MeasurementError, match=r"Accelerometer on Pelvis.*frames 3, 8, 30"
    ) as caught:
        run(tree, scene, sensors)
    assert caught.value.frames == (3, 8, 30)
    found = run(tree, scene, sensors, missing="leave_out")
    assert found.left_out == {"Accelerometer on Pelvis": (3, 8, 30)}
    whole = run(tree, scene)
    np.testing.assert_allclose(found.torque, whole.torque[found.frames], rtol=0, atol=1e-12)
    assert len(found.frames) == 37
    value[:] = np.nan
    with pytest.raises(MeasurementError, match="at least one frame"):
        run(tree, scene, sensors, missing="leave_out")


def test_a_force_too_free_for_double_precision_is_bounded_and_said_to_be(tree, scene):
    sensors = [FreeWrench(s.link, 1e6) if isinstance(s, FreeWrench) else s for s in scene.sensors]
    found = run(tree, scene, sensors)
    assert "force_sd lowered to 1000 N" in found.assumed[0]
    assert np.all(np.isfinite(found.torque_sd))
    assert rms(found.torque - scene.torque) < 0.05
    # Wholly free, the other hand takes the load's place, and nothing else changes.
    bound, wild = (
        run(tree, scene, [*scene.sensors, FreeWrench("LeftHandCOM", sd, sd)]) for sd in (1e4, 1e9)
    )
    assert [line.split(";")[0] for line in wild.assumed] == [
        "FreeWrench on LeftHandCOM: force_sd lowered to 10000 N",
        "FreeWrench on LeftHandCOM: moment_sd lowered to 10000 N m",
    ]
    np.testing.assert_array_equal(wild.torque_sd, bound.torque_sd)


@pytest.mark.parametrize(
    ("sensor", "error", "message"),
    [
        (FreeWrench("Tail"), UnknownLinkError, "Tail"),
        (ForceTorque("LeftHandCOM", np.zeros((40, 6)), 1e20), CovarianceError, "at most"),
        (ForceTorque("LeftHandCOM", np.zeros((40, 6)), 1e-20), CovarianceError, "at least"),
        (ForceTorque("LeftHandCOM", np.zeros((40, 6)), np.nan), CovarianceError, "finite"),
        (ForceTorque("LeftHandCOM", np.zeros((40, 6)), -1.0), CovarianceError, "positive"),
        (
            ForceTorque("LeftHandCOM", np.zeros((40, 6)), np.triu(np.ones((6, 6)))),
            CovarianceError,
            "symmetric",
        ),
        (ForceTorque("LeftHandCOM", np.zeros((40, 6)), np.ones(5)), MeasurementError, "covariance"),
        (ForceTorque("LeftHandCOM", np.zeros((40, 3)), 1.0), MeasurementError, "value of shape"),
        (ForceTorque("LeftHandCOM", np.zeros((39, 6)), 1.0), MeasurementError, "40 frames"),
        (
            ForceTorque("LeftHandCOM", np.zeros((40, 6)), 1.0, rotation=-np.eye(3)),
            MeasurementError,
            "rotation matrix",
        ),
        (
            ForceTorque("LeftHandCOM", np.zeros((40, 6)), 1.0, (1.0, 2.0)),
            MeasurementError,
            "position",
        ),
        (JointAcceleration(np.zeros((40, 65)), 1.0), MeasurementError, "value of shape"),
        (JointAcceleration(np.zeros((40, 66)), np.ones(3)), MeasurementError, "covariance"),
        (JointAcceleration(np.zeros((40, 66)), np.ones((7, 66))), MeasurementError, "covariance"),
        (
            ForceTorque("LeftHandCOM", np.zeros((40, 6)), np.ones((1, 6, 6))),
            MeasurementError,
            "covariance",
        ),
        (
            ForceTorque("LeftHandCOM", np.zeros((40, 6)), 1.0, np.zeros((9, 3))),
            MeasurementError,
            "position",
        ),
        (
            ForceTorque("LeftHandCOM", np.zeros((40, 6)), 1.0, rotation=np.ones((9, 3, 3))),
            MeasurementError,
            "rotation",
        ),
        (JointAcceleration(np.zeros((40, 66)), 0.0), CovarianceError, "positive"),
    ],
)
def test_sensors_that_cannot_be_are_refused_by_name(tree, scene, sensor, error, message):
    with pytest.raises(error, match=message):
        run(tree, scene, [*scene.sensors, sensor])


@pytest.mark.parametrize(
    "change",
    [
        {"dynamics": 0.0},
        {"kinematics": -1.0},
        {"acceleration_prior": float("inf")},
        {"prior_mean": float("nan")},
    ],
)
def test_model_covariances_that_cannot_be_are_refused(change):
    with pytest.raises(CovarianceError, match=next(iter(change))):
        ModelCovariances(**change)


def test_names_lead_to_columns(tree, scene):
    found = run(tree, scene, spreads=False)
    assert found.torque_sd is None
    assert tree.link_names[found.link("T8")] == "T8"
    assert tree.joint_names[found.joint("jL5S1")] == "jL5S1"
    for call in (found.link, found.joint):
        with pytest.raises(UnknownLinkError, match="nowhere"):
            call("nowhere")
