"""One frame in, one estimate out: the numbers of the whole run, whatever changes or goes wrong."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace

import numpy as np
import pytest

from estimation import (
    Accelerometer,
    CovarianceError,
    Estimator,
    ForceTorque,
    FreeWrench,
    JointAcceleration,
    MeasurementError,
    ModelCovariances,
    UnknownLinkError,
    compile_kernel,
    estimate,
    real_tree,
)

from .balanced_scene import balanced, random_motion

FRAMES = 12


@pytest.fixture(scope="module", autouse=True)
def kernel():
    assert compile_kernel().ready


@pytest.fixture(scope="module")
def scene(person):
    rng = np.random.default_rng(23)
    return balanced(person, *random_motion(person, rng, FRAMES), rng)


@pytest.fixture(scope="module")
def tree(person):
    return real_tree(person)


def named(scene):
    """The scene's sensors by name, without any values."""
    out = {}
    for place, sensor in enumerate(scene.sensors):
        given = sensor if isinstance(sensor, FreeWrench) else replace(sensor, value=())
        out[f"{type(sensor).__name__} {place}"] = given
    return out


def readings(scene, frame, names=None):
    every = zip(named(scene), scene.sensors, strict=True)
    return {
        name: sensor.value[frame]
        for name, sensor in every
        if not isinstance(sensor, FreeWrench) and (names is None or name in names)
    }


def assert_same(found, whole, frame):
    """Every array of a frame's estimate against the whole run's row, each to its own scale."""
    for field in fields(found):
        value, expected = getattr(found, field.name), getattr(whole, field.name)
        if isinstance(expected, np.ndarray) and field.name != "frames":
            scale = max(1.0, float(np.abs(expected[frame]).max()))
            np.testing.assert_allclose(
                value[0], expected[frame], rtol=0, atol=1e-9 * scale, err_msg=field.name
            )


@pytest.mark.parametrize(("engine", "frames"), [("kernel", FRAMES), ("numpy", 2)])
def test_a_stream_gives_the_numbers_of_the_whole_run(tree, scene, engine, frames):
    whole = estimate(tree, scene.q, scene.v, scene.a, scene.sensors, engine=engine)
    live = Estimator(tree, named(scene), engine=engine)
    assert live.engine == engine
    for frame in range(frames):
        found = live.step(scene.q[frame], scene.v[frame], readings(scene, frame))
        assert_same(found, whole, frame)
        assert (found.frames, found.engine, found.sites) == ([frame], engine, whole.sites)
        assert found.bands == "uncertainty"


def test_accelerations_that_no_sensor_measures_are_those_of_the_motion(tree, scene):
    kept = {
        name: sensor
        for name, sensor in named(scene).items()
        if isinstance(sensor, ForceTorque | FreeWrench)
    }
    sensors = [s for s in scene.sensors if isinstance(s, ForceTorque | FreeWrench)]
    whole = estimate(tree, scene.q, scene.v, scene.a, sensors, spreads=False)
    live = Estimator(tree, kept, spreads=False)
    assert live.assumed == whole.assumed
    values = readings(scene, 3, kept)
    with pytest.raises(MeasurementError, match="derived from the motion"):
        live.step(scene.q[3], scene.v[3], values)
    found = live.step(scene.q[3], scene.v[3], values, scene.a[3])
    np.testing.assert_allclose(found.torque[0], whole.torque[3], rtol=0, atol=1e-9)
    assert (found.torque_sd, found.bands) == (None, "none")


def test_noise_and_free_links_change_while_the_stream_runs(tree, scene):
    plate = ForceTorque(
        "LeftFoot", scene.sensors[-1].value, np.eye(6), (0.1, 0.2, 0.3), fixed_to="world"
    )
    live = Estimator(tree, named(scene))
    live.step(scene.q[0], scene.v[0], readings(scene, 0))
    names = list(named(scene))
    gone, changed, moved = names[3], names[4], names[-1]
    louder = replace(scene.sensors[4], covariance=0.4)
    live.change(
        {"left hand": FreeWrench("LeftHandCOM", 30.0), gone: None, changed: louder, moved: plate}
    )
    sensors = list(scene.sensors)
    sensors[4], sensors[-1] = louder, plate
    sensors[3:4] = []
    sensors.append(FreeWrench("LeftHandCOM", 30.0))
    whole = estimate(tree, scene.q, scene.v, scene.a, sensors, engine="kernel")
    assert set(live.measurements) == {*names, "left hand"} - {gone}
    found = live.step(scene.q[5], scene.v[5], readings(scene, 5, live.measurements))
    assert found.sites == ("RightHandCOM", "LeftHandCOM")
    assert_same(found, whole, 5)


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ("nan", "Accelerometer 2: expected finite"),
        ("shape", r"Accelerometer 2: expected shape \(3,\), got \(2,\)"),
        ("missing", "Accelerometer 2: expected a reading"),
        ("unknown", "nose: expected a reading of one of"),
        ("quaternion", "q: expected a unit base quaternion"),
        ("q", "q: expected finite"),
        ("v", r"v: expected shape \(72,\)"),
    ],
)
def test_a_frame_that_makes_no_sense_is_refused_and_the_next_one_estimated(
    tree, scene, what, message
):
    live = Estimator(tree, named(scene))
    first = live.step(scene.q[1], scene.v[1], readings(scene, 1))
    q, v, values = scene.q[0].copy(), scene.v[0], readings(scene, 0)
    if what == "missing":
        del values["Accelerometer 2"]
    elif what == "unknown":
        values["nose"] = np.zeros(3)
    elif what in ("nan", "shape"):
        values["Accelerometer 2"] = [np.nan, 0.0, 0.0] if what == "nan" else [0.0, 0.0]
    elif what == "quaternion":
        q[3:7] *= 2.0
    elif what == "q":
        q[9] = np.inf
    else:
        v = v[:4]
    with pytest.raises(MeasurementError, match=message):
        live.step(q, v, values)
    again = live.step(scene.q[1], scene.v[1], readings(scene, 1))
    np.testing.assert_array_equal(again.torque_sd, first.torque_sd)
    assert again.frames == [1]


def test_a_change_that_cannot_be_changes_nothing(tree, scene):
    live = Estimator(tree, named(scene))
    before = live.step(scene.q[0], scene.v[0], readings(scene, 0))
    for change, error in (
        ({"nose": None}, MeasurementError),
        ({"tail": FreeWrench("Tail")}, UnknownLinkError),
        ({"Accelerometer 2": Accelerometer("Pelvis", (), np.ones(7))}, MeasurementError),
        ({"joints": JointAcceleration((), 0.0)}, CovarianceError),
    ):
        with pytest.raises(error):
            live.change(change)
    after = live.step(scene.q[0], scene.v[0], readings(scene, 0))
    np.testing.assert_array_equal(after.torque, before.torque)


def test_an_estimate_stays_as_it_was_when_the_next_one_comes(tree, scene):
    live = Estimator(tree, named(scene), covariances=ModelCovariances())
    first = live.step(scene.q[0], scene.v[0], readings(scene, 0))
    kept = first.torque.copy()
    live.step(scene.q[1], scene.v[1], readings(scene, 1))
    np.testing.assert_array_equal(first.torque, kept)


def test_threads_take_turns_on_one_stream(tree, scene):
    whole = estimate(tree, scene.q, scene.v, scene.a, scene.sensors, engine="kernel")
    live = Estimator(tree, named(scene))
    given = [readings(scene, frame) for frame in range(FRAMES)]

    def follow(frame):
        return [live.step(scene.q[frame], scene.v[frame], given[frame]) for _ in range(40)]

    with ThreadPoolExecutor(4) as pool:
        for frame, found in enumerate(pool.map(follow, range(FRAMES))):
            for estimated in found:
                assert_same(estimated, whole, frame)
