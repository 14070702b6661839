"""Simulated markers: rigid on their segments, seen with the stated errors."""

import numpy as np
import pytest

from human import HumanModel, Subject, frame_poses, from_urdf, generate_model, to_urdf
from human.kinematics import forward_kinematics
from human.simulate import (
    Dropouts,
    MarkerNoise,
    SensorNoise,
    SimulationError,
    simulate_markers,
    wear_markers,
)


@pytest.fixture(scope="module")
def model() -> HumanModel:
    return generate_model(Subject(1.8, 75.0, "male"))


def moving(model: HumanModel, frames: int) -> tuple[np.ndarray, np.ndarray]:
    time = np.arange(frames) / 100.0
    q = np.tile(model.neutral(), (frames, 1))
    q[:, 7:] = 0.3 * np.sin(time)[:, None] * np.cos(np.arange(model.n_dof))
    q[:, :3] = np.outer(time, [1.0, 0.2, 0.1])
    return time, q


def test_markers_stay_at_their_place_in_the_segment(model: HumanModel) -> None:
    body = wear_markers(model, "isb")
    time, q = moving(model, 50)
    seen = simulate_markers(body, time, q, np.random.default_rng(0))
    assert seen.valid.all()
    poses = forward_kinematics(model, q)
    for name in ("R_HM2", "L_FCC", "CV7"):
        k = body.marker_names.index(name)
        rotation, origin = frame_poses(model, poses, model.segment_names[body.segment[k]])
        local = np.einsum("tji,tj->ti", rotation, seen.position[:, k] - origin)
        np.testing.assert_allclose(local, np.tile(body.offset[k], (50, 1)), atol=1e-12)


def test_both_sides_are_mirror_images(model: HumanModel) -> None:
    body = wear_markers(model, "opencap")
    for right, left in (("r.ASIS", "L.ASIS"), ("R_elbow_lat", "L_elbow_lat"), ("r_calc", "L_calc")):
        one, other = (body.offset[body.marker_names.index(name)] for name in (right, left))
        np.testing.assert_allclose(one * [1.0, -1.0, 1.0], other, atol=1e-12)


def test_noise_offsets_and_losses_are_as_stated(model: HumanModel) -> None:
    body = wear_markers(model, "cgm")
    time, q = moving(model, 2000)
    noise = MarkerNoise(SensorNoise(sd=0.002, offset_sd=0.01), Dropouts(per_s=1.0, mean_s=0.25))
    clean = simulate_markers(body, time, q, np.random.default_rng(0))
    first, again = (
        simulate_markers(body, time, q, np.random.default_rng(3), noise=noise) for _ in range(2)
    )
    np.testing.assert_array_equal(first.position, again.position)
    error = np.where(first.valid[..., None], first.position - clean.position, np.nan)
    offset = np.nanmean(error, axis=0)
    assert np.nanstd(error - offset) == pytest.approx(0.002, rel=0.02)
    assert np.std(offset) == pytest.approx(0.01, rel=0.2)
    # One loss a second that lasts a quarter: a fifth of the time.
    assert np.mean(~first.valid) == pytest.approx(0.2, abs=0.03)
    assert np.all(first.position[~first.valid] == 0.0)


def test_a_model_of_nobody_is_refused(model: HumanModel) -> None:
    with pytest.raises(SimulationError, match="known subject"):
        wear_markers(from_urdf(to_urdf(model)), "isb")
