import numpy as np
import pinocchio as pin
import pytest

from estimation import (
    IllConditionedError,
    LinkMotion,
    MeasurementError,
    PlacementEstimator,
    place_imu,
)

PLACE = np.array([0.03, -0.05, -0.17])
TURNED = pin.exp3(np.array([0.4, -0.9, 1.3]))
GRAVITY = np.array([0.0, 0.0, -9.81])


def measured(person, q, v, a, link="RightForeArm"):
    """What Pinocchio says a sensor at PLACE feels, and how its link moves."""
    model = person.pinocchio().copy()
    holder = model.frames[model.getFrameId(link)]
    mounted = holder.placement * pin.SE3(TURNED, PLACE)
    sensor = model.addFrame(pin.Frame("sensor", holder.parentJoint, 0, mounted, pin.OP_FRAME))
    data = model.createData()
    rows = []
    for i in range(len(q)):
        pin.forwardKinematics(model, data, q[i], v[i], a[i])
        pin.updateFramePlacements(model, data)
        frame = model.getFrameId(link)
        twist = pin.getFrameVelocity(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
        rate = pin.getFrameClassicalAcceleration(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
        R_sensor = data.oMf[sensor].rotation.copy()
        felt = pin.getFrameClassicalAcceleration(model, data, sensor, pin.LOCAL).linear
        rows.append(
            (
                data.oMf[frame].rotation.copy(),
                twist.angular.copy(),
                rate.angular.copy(),
                rate.linear.copy(),
                felt - R_sensor.T @ GRAVITY,
                R_sensor,
            )
        )
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return LinkMotion(*columns[:4]), columns[4], columns[5]


def part(link, frames):
    return LinkMotion(
        link.rotation[frames],
        link.angular_velocity[frames],
        link.angular_acceleration[frames],
        link.acceleration[frames],
    )


@pytest.fixture(scope="module")
def forearm(person):
    """A forearm thrown about: any q, v and a will do, the equations hold frame by frame."""
    rng = np.random.default_rng(2)
    count = 120
    q = np.tile(person.neutral(), (count, 1))
    q[:, 7:] = rng.uniform(-0.8, 0.8, (count, 66))
    quaternion = rng.normal(size=(count, 4))
    q[:, 3:7] = quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
    return measured(person, q, rng.normal(size=(count, 72)), 4.0 * rng.normal(size=(count, 72)))


def test_exact_measurements_give_the_exact_place(forearm):
    link, felt, R_sensor = forearm
    found = place_imu(link, felt, R_sensor)
    np.testing.assert_allclose(found.position, PLACE, atol=1e-11)
    assert found.residual_m_s2 < 1e-11
    assert found.samples == 120
    assert found.condition_number < 5.0


def test_walking_with_swinging_arms_is_enough_for_a_forearm_sensor(person, walk):
    motion = walk.motion
    link, felt, R_sensor = measured(person, motion.q, motion.v, motion.a)
    felt = felt + np.random.default_rng(1).normal(scale=0.033, size=felt.shape)
    found = place_imu(link, felt, R_sensor, accelerometer_sd=0.033)
    assert np.abs(found.position - PLACE).max() < 0.01
    assert np.all(np.abs(found.position - PLACE) < 4.0 * found.sd)


def test_place_bias_and_covariance_are_those_of_plain_least_squares(forearm):
    link, felt, R_sensor = forearm
    rng = np.random.default_rng(3)
    bias = np.array([0.2, -0.1, 0.05])
    felt = felt + bias + rng.normal(scale=0.1, size=felt.shape)
    rows, right = [], []
    for k in range(len(felt)):
        w, alpha = link.angular_velocity[k], link.angular_acceleration[k]
        columns = [
            np.cross(alpha, axis) + np.cross(w, np.cross(w, axis)) for axis in link.rotation[k].T
        ]
        rows.append(np.column_stack([*columns, R_sensor[k]]))
        right.append(R_sensor[k] @ felt[k] - link.acceleration[k] + GRAVITY)
    A, b = np.concatenate(rows), np.concatenate(right)
    for used, bias_too in ((A[:, :3], False), (A, True)):
        solution, rest, *_ = np.linalg.lstsq(used, b, rcond=None)
        found = place_imu(link, felt, R_sensor, estimate_bias=bias_too)
        np.testing.assert_allclose(found.position, solution[:3], atol=1e-12)
        np.testing.assert_allclose(found.residual_m_s2, np.sqrt(rest[0] / len(b)), rtol=1e-10)
        variance = rest[0] / (len(b) - used.shape[1])
        expected = variance * np.linalg.inv(used.T @ used)[:3, :3]
        np.testing.assert_allclose(found.covariance, expected, rtol=1e-9, atol=1e-18)
    np.testing.assert_allclose(found.bias, solution[3:], atol=1e-11)
    np.testing.assert_allclose(found.bias, bias, atol=0.03)
    singular = np.linalg.svd(A[:, :3])[1]
    plain = place_imu(link, felt, R_sensor)
    np.testing.assert_allclose(plain.condition_number, singular[0] / singular[2], rtol=1e-10)
    np.testing.assert_allclose(plain.excitation_per_s2, singular / np.sqrt(120), rtol=1e-10)


@pytest.mark.parametrize("estimate_bias", [False, True])
@pytest.mark.parametrize("forgetting", [1.0, 0.98])
def test_frame_by_frame_equals_all_at_once(forearm, estimate_bias, forgetting):
    link, felt, R_sensor = forearm
    felt = felt + np.random.default_rng(4).normal(scale=0.05, size=felt.shape)
    whole, live, pieces = (
        PlacementEstimator(estimate_bias=estimate_bias, forgetting=forgetting) for _ in range(3)
    )
    whole.add(link, felt, R_sensor)
    for k in range(len(felt)):
        live.add(part(link, k), felt[k], R_sensor[k])
    for cut in (slice(0, 1), slice(1, 50), slice(50, None)):
        pieces.add(part(link, cut), felt[cut], R_sensor[cut])
    once = whole.result()
    for other in (live.result(), pieces.result()):
        np.testing.assert_allclose(other.position, once.position, atol=1e-12)
        np.testing.assert_allclose(other.bias, once.bias, atol=1e-11)
        np.testing.assert_allclose(other.covariance, once.covariance, rtol=1e-9, atol=1e-18)
        assert other.residual_m_s2 == pytest.approx(once.residual_m_s2, rel=1e-10)
        assert other.samples == pytest.approx(once.samples)


def test_forgetting_follows_a_sensor_that_slips(forearm):
    link, felt, R_sensor = forearm
    slipped = np.array([0.0, 0.02, -0.04])
    A = (
        pin_skew(link.angular_acceleration)
        + pin_skew(link.angular_velocity) @ pin_skew(link.angular_velocity)
    ) @ link.rotation
    felt_after = felt + np.einsum("kji,kjl,l->ki", R_sensor, A, slipped)
    estimator = PlacementEstimator(forgetting=0.9)
    estimator.add(link, felt, R_sensor).add(link, felt_after, R_sensor)
    np.testing.assert_allclose(estimator.result().position, PLACE + slipped, atol=1e-4)
    stubborn = PlacementEstimator().add(link, felt, R_sensor).add(link, felt_after, R_sensor)
    np.testing.assert_allclose(stubborn.result().position, PLACE + 0.5 * slipped, atol=1e-9)


def pin_skew(vectors):
    return np.array([pin.skew(vector) for vector in vectors])


@pytest.mark.parametrize("known", [True, False], ids=["noise known", "noise from the residual"])
def test_the_covariance_covers_the_error(forearm, known):
    link, felt, R_sensor = forearm
    rng = np.random.default_rng(6)
    few, draws, inside = part(link, slice(0, 25)), 400, 0
    for _ in range(draws):
        noisy = felt[:25] + rng.normal(scale=0.3, size=(25, 3))
        sd = 0.3 if known else None
        found = place_imu(few, noisy, R_sensor[:25], accelerometer_sd=sd)
        error = found.position - PLACE
        # 95 % point of chi-square with three degrees of freedom.
        inside += error @ np.linalg.solve(found.covariance, error) < 7.815
    assert 0.92 <= inside / draws <= 0.98


def test_turning_about_one_axis_leaves_the_place_along_it_open(forearm):
    _, felt, R_sensor = forearm
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    count = len(felt)
    speed = np.random.default_rng(0).normal(size=(2, count, 1))
    one_axis = LinkMotion(
        np.broadcast_to(np.eye(3), (count, 3, 3)),
        axis * speed[0],
        axis * speed[1] * 5.0,
        np.zeros((count, 3)),
    )
    with pytest.raises(IllConditionedError, match="not determined") as caught:
        place_imu(one_axis, felt, R_sensor)
    assert abs(caught.value.weakest @ axis) == pytest.approx(1.0, abs=1e-6)
    assert caught.value.condition_number > 1e6


def test_a_link_at_rest_is_refused_even_where_noise_turns_it(forearm):
    link, felt, R_sensor = forearm
    count = len(felt)
    noise = np.random.default_rng(0).normal(scale=0.2, size=(count, 3))
    rest = LinkMotion(link.rotation, np.zeros((count, 3)), noise, np.zeros((count, 3)))
    with pytest.raises(IllConditionedError, match="excitation"):
        place_imu(rest, felt, R_sensor)
    still = LinkMotion(link.rotation, *np.zeros((3, count, 3)))
    with pytest.raises(IllConditionedError, match="inf"):
        place_imu(still, felt, R_sensor)
    with pytest.raises(IllConditionedError):
        PlacementEstimator().result()


def test_an_unknown_bias_makes_the_place_less_certain(forearm):
    link, felt, R_sensor = forearm
    sure = place_imu(link, felt, R_sensor, accelerometer_sd=0.1)
    careful = place_imu(link, felt, R_sensor, accelerometer_sd=0.1, estimate_bias=True)
    assert np.all(np.linalg.eigvalsh(careful.covariance - sure.covariance) > 0.0)
    np.testing.assert_allclose(careful.bias, 0.0, atol=1e-10)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"accelerometer": np.zeros((3, 2))}, "accelerometer: expected shape"),
        ({"accelerometer": np.zeros((0, 3))}, "accelerometer: expected shape"),
        ({"accelerometer": np.full((4, 3), np.nan)}, "accelerometer: .* frame 0"),
        ({"sensor_rotation": np.eye(3)}, r"sensor_rotation: expected shape \(4, 3, 3\)"),
    ],
)
def test_what_does_not_fit_is_refused(forearm, change, words):
    link, felt, R_sensor = forearm
    few = slice(0, 4)
    given = {"accelerometer": felt[few], "sensor_rotation": R_sensor[few]} | change
    with pytest.raises(MeasurementError, match=words):
        PlacementEstimator().add(part(link, few), **given)


@pytest.mark.parametrize("setting", [{"accelerometer_sd": 0.0}, {"forgetting": 1.5}])
def test_impossible_settings_are_refused(setting):
    with pytest.raises(MeasurementError, match=next(iter(setting))):
        PlacementEstimator(**setting)


def test_one_frame_alone_does_not_tell_its_own_noise(forearm):
    link, felt, R_sensor = forearm
    one = PlacementEstimator().add(part(link, 5), felt[5], R_sensor[5])
    with pytest.raises(MeasurementError, match="accelerometer_sd"):
        one.result()
    sure = PlacementEstimator(accelerometer_sd=0.01).add(part(link, 5), felt[5], R_sensor[5])
    np.testing.assert_allclose(sure.result().position, PLACE, atol=1e-10)
