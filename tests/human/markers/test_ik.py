from dataclasses import replace

import numpy as np
import pytest

from human.markers import MarkerFitError, fit_markers, fit_markers_in_windows
from human.rotations import quaternion_multiply, rotation_vector_to_matrix
from human.rotations import rotation_vector_to_quaternion as to_quaternion

from .worn import recorded, swaying, worn

LIMBS = tuple(
    f"{side}{part}"
    for side in ("Right", "Left")
    for part in ("Shoulder", "UpperArm", "ForeArm", "Hand", "UpperLeg", "LowerLeg", "Foot")
)
#: Segments that a full marker set has markers on: neither the inner spine and neck nor the toes.
SEEN = ("Pelvis", "T8", "Head", *LIMBS)


@pytest.fixture(scope="module")
def body(model):
    return worn(model, SEEN, each=4)


@pytest.fixture(scope="module")
def q(model):
    return swaying(model, 96)


@pytest.fixture(scope="module")
def shown(model):
    return np.array([k for k, n in enumerate(model.dof_names) if "BallFoot" not in n])


def error_rad(fitted, q, shown) -> np.ndarray:
    return np.abs(fitted.motion.joint_angles - q[fitted.frame][:, 7:])[:, shown]


def seen_without(body, frames: int, segment: str, span: slice, left: int) -> np.ndarray:
    """A mask in which a segment keeps so many of its markers over a span of frames."""
    valid = np.ones((frames, len(body.marker_names)), dtype=bool)
    mine = np.flatnonzero(body.segment == body.model.segment_index(segment))
    valid[span, mine[left:, None]] = False
    return valid


def test_exact_markers_give_the_posture_back(model, body, q, shown) -> None:
    recording = recorded(body, q)
    # Another file of the same person: another prefix, one marker that nobody knows.
    names = ("Elsewhere:Wand", *(f"Trial:{name}" for name in body.marker_names))
    more = np.concatenate([np.zeros((len(q), 1, 3)), recording.position], axis=1)
    seen = np.concatenate([np.ones((len(q), 1), dtype=bool), recording.valid], axis=1)
    fitted = fit_markers(body, replace(recording, marker_names=names, position=more, valid=seen))
    assert len(fitted.motion) == len(q)
    assert np.max(error_rad(fitted, q, shown)) < 1e-6
    assert np.max(np.abs(fitted.motion.q[:, :3] - q[:, :3])) < 1e-7
    assert np.max(fitted.residual_m) < 1e-6
    assert fitted.unobserved_dofs == tuple(n for n in model.dof_names if "BallFoot" in n)
    assert fitted.held.any(axis=0).tolist() == ["BallFoot" in n for n in model.dof_names]


def test_a_spine_with_markers_of_its_own_need_not_share_its_bend(model, q) -> None:
    every = worn(model, model.segment_names)
    kinked = q.copy()
    kinked[:, 7 + model.dof_names.index("jL1T12_roty")] += 0.3
    fitted = fit_markers(every, recorded(every, kinked))
    assert np.max(error_rad(fitted, kinked, np.arange(model.n_dof))) < 1e-6
    assert fitted.unobserved_dofs == ()


def test_noise_spreads_the_angles_as_stated(model, body, rng) -> None:
    q = np.tile(swaying(model, 40)[20], (400, 1))
    noise = body.sd_m[:, None] * rng.normal(size=(400, len(body.sd_m), 3))
    fitted = fit_markers(body, recorded(body, q, noise))
    free = np.array([k for k, n in enumerate(model.dof_names) if "Leg" in n or "Hip" in n])
    spread = np.sqrt(np.mean(error_rad(fitted, q, free) ** 2, axis=0))
    assert np.all(np.abs(spread / fitted.angle_sd_rad[free] - 1.0) < 0.15)
    # Three distances a marker, less what the fit takes up.
    taken = (6 + model.n_dof - 6 - 8) / (3 * len(body.sd_m))
    assert fitted.rms_m == pytest.approx(0.005 * np.sqrt(3 * (1 - taken)), rel=0.05)


def test_turning_the_scene_turns_the_base_alone(body, q, rng) -> None:
    noise = 0.004 * rng.normal(size=(len(q), len(body.marker_names), 3))
    here = recorded(body, q, noise)
    turn, shift = np.array([0.0, 0.0, 2.0]), np.array([3.0, -2.0, 0.0])
    there = replace(here, position=here.position @ rotation_vector_to_matrix(turn).T + shift)
    first, second = fit_markers(body, here).motion, fit_markers(body, there).motion
    assert np.max(np.abs(first.joint_angles - second.joint_angles)) < 1e-5
    assert np.max(np.abs(first.v - second.v)) < 1e-3
    turned = quaternion_multiply(to_quaternion(turn), first.q[:, 3:7])
    assert np.max(1.0 - np.abs(np.sum(turned * second.q[:, 3:7], axis=1))) < 1e-9


def test_windows_give_the_numbers_of_the_whole(model, body, rng) -> None:
    q = swaying(model, 700)
    valid = seen_without(body, len(q), "RightHand", slice(500, 530), 2)
    valid[300:360] = False
    recording = recorded(body, q, 0.003 * rng.normal(size=(*valid.shape, 3)), valid)
    whole = fit_markers(body, recording).motion
    parts = [part.motion for part in fit_markers_in_windows(body, recording, seconds=1.7)]
    assert len(parts) == 5
    assert np.array_equal(np.concatenate([part.time_s for part in parts]), whole.time_s)
    for name in ("q", "v", "a"):
        together = np.concatenate([getattr(part, name) for part in parts])
        assert np.max(np.abs(together - getattr(whole, name))) < 1e-9
    for name, flag in whole.flags.items():
        assert np.array_equal(np.concatenate([part.flags[name] for part in parts]), flag), name


def test_a_short_loss_is_carried_over_and_a_longer_one_said(body, q, shown) -> None:
    for frames, flag in ((12, "bridged"), (50, "unseen")):
        span = slice(20, 20 + frames)
        valid = seen_without(body, len(q), "RightForeArm", span, 1)
        valid &= seen_without(body, len(q), "RightHand", span, 0)
        fitted = fit_markers(body, recorded(body, q, valid=valid))
        assert len(fitted.motion) == len(q)
        assert fitted.motion.flags[flag].sum() >= frames
        lost = fitted.motion.unseen_segments
        assert set(lost) == ({"RightHand", "RightForeArm"} if flag == "unseen" else set())
        assert all(np.all(where[span]) and where.sum() < frames + 4 for where in lost.values())
        error = error_rad(fitted, q, shown)
        assert np.all(fitted.held[span, fitted.model.dof_names.index("jRightWrist_rotx")])
        # The rest of the body is as if nothing had happened.
        away = [k for k, n in enumerate(fitted.model.dof_names) if "Hip" in n or "jLeft" in n]
        away = [k for k in away if "BallFoot" not in fitted.model.dof_names[k]]
        assert not np.any(fitted.held[:, away])
        assert np.max(error_rad(fitted, q, away)) < 1e-3
        if flag == "bridged":
            assert np.max(error) < np.deg2rad(3.0)
            assert any("Carried over" in note for note in fitted.notes)


def test_a_segment_whose_markers_never_show_in_a_recording_is_flagged_throughout(body, q) -> None:
    valid = seen_without(body, len(q), "RightHand", slice(None), 0)
    motion = fit_markers(body, recorded(body, q, valid=valid)).motion
    assert list(motion.unseen_segments) == ["RightHand"]
    assert np.all(motion.unseen_segments["RightHand"])


def test_frames_without_a_body_are_bridged_or_left_out(body, q, shown) -> None:
    valid = np.ones((len(q), len(body.marker_names)), dtype=bool)
    valid[10:20] = valid[40:80] = False
    fitted = fit_markers(body, recorded(body, q, valid=valid))
    assert set(range(len(q))) - set(fitted.frame.tolist()) == set(range(40, 80))
    assert fitted.motion.flags["bridged"].sum() == 10
    assert np.flatnonzero(fitted.motion.flags["gap"]).tolist() == [39, 40]
    assert np.max(error_rad(fitted, q, shown)) < np.deg2rad(2.0)
    assert any("Left out" in note and "0.40 to 0.79" in note for note in fitted.notes)


def test_exchanged_markers_are_named_and_move_nothing(body, q, shown) -> None:
    recording = recorded(body, q)
    pair = [
        int(np.flatnonzero(body.segment == body.model.segment_index(f"{side}LowerLeg"))[0])
        for side in ("Right", "Left")
    ]
    position = recording.position.copy()
    position[30:60, pair] = position[30:60, pair[::-1]]
    fitted = fit_markers(body, replace(recording, position=position))
    assert np.max(error_rad(fitted, q, shown)) < 1e-6
    assert np.argwhere(fitted.outlier).tolist() == [
        [k, m] for k in range(30, 60) for m in sorted(pair)
    ]
    for marker in pair:
        assert any(n.startswith(body.marker_names[marker]) for n in fitted.notes)


def test_a_joint_bent_beyond_its_limit_rests_on_it_and_says_so(model, body, q) -> None:
    dof = model.dof_names.index("jRightKnee_roty")
    bent = q.copy()
    bent[:, 7 + dof] = model.upper[dof] + 0.2
    fitted = fit_markers(body, recorded(body, bent))
    assert np.all(fitted.motion.flags["limit_active"])
    assert np.max(np.abs(fitted.motion.joint_angles[:, dof] - model.upper[dof])) < 0.03


def test_a_body_without_a_chest_stands_upright_with_hanging_arms(model, q) -> None:
    legs = worn(model, ("Pelvis", *(s for s in LIMBS if "Leg" in s or "Foot" in s)))
    fitted = fit_markers(legs, recorded(legs, q))
    arm = fitted.motion.joint_angles[:, model.dof_names.index("jRightShoulder_rotx")]
    assert np.all(arm == np.pi / 2)
    assert {"jL5S1_roty", "jRightElbow_rotz"} <= set(fitted.unobserved_dofs)
    assert "jRightHip_roty" not in fitted.unobserved_dofs
    assert fitted.motion.provenance.assumed["jL5S1_roty"]


def test_what_cannot_be_fitted_is_refused_by_name(model, body, q) -> None:
    recording = recorded(body, q)
    with pytest.raises(MarkerFitError, match="Elsewhere"):
        fit_markers(body, replace(recording, marker_names=("Elsewhere",) * len(body.marker_names)))
    millimetres = replace(recording, position=1e3 * recording.position)
    with pytest.raises(MarkerFitError, match="within 60 mm"):
        fit_markers(body, millimetres)
    with pytest.raises(MarkerFitError, match="where the body is"):
        one = worn(model, ("Head",), each=2)
        fit_markers(one, recorded(one, q))
