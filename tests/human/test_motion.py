import pickle
from dataclasses import replace

import numpy as np
import pytest

from human import DOF_NAMES, Motion, MotionError, Provenance


@pytest.fixture
def motion(rng):
    frames = 12
    q = rng.normal(size=(frames, 73))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    return Motion(
        DOF_NAMES,
        np.arange(frames) * 0.1,
        q,
        rng.normal(size=(frames, 72)),
        rng.normal(size=(frames, 72)),
        flags={"odd": np.arange(frames) % 2 == 1},
        provenance=Provenance("made here", steps=("drawn",), assumed={"legs": "not measured"}),
    )


def test_arrays_are_read_only_and_own(motion):
    with pytest.raises(ValueError, match="read-only"):
        motion.q[0, 0] = 1.0
    with pytest.raises(TypeError):
        motion.flags["new"] = motion.flags["odd"]
    source = np.array(motion.time_s)
    other = replace(motion, time_s=source)
    source[0] = -5.0
    assert other.time_s[0] == 0.0


def test_slice_is_half_open_and_carries_everything(motion):
    part = motion.slice(0.25, 0.7)
    np.testing.assert_allclose(part.time_s, [0.3, 0.4, 0.5, 0.6])
    np.testing.assert_array_equal(part.q, motion.q[3:7])
    np.testing.assert_array_equal(part.a, motion.a[3:7])
    np.testing.assert_array_equal(part.flags["odd"], motion.flags["odd"][3:7])
    assert part.provenance is motion.provenance
    before, after = motion.slice(end_s=0.55), motion.slice(start_s=0.55)
    assert len(before) + len(after) == len(motion)


def test_views(motion):
    assert motion.joint_angles.shape == motion.joint_rates.shape == (12, 66)
    assert motion.duration_s == pytest.approx(1.1)


def test_select_by_mask_and_index(motion):
    odd = motion.select(motion.flags["odd"])
    np.testing.assert_array_equal(odd.v, motion.v[1::2])
    np.testing.assert_array_equal(motion.select(np.array([1, 4])).time_s, motion.time_s[[1, 4]])
    with pytest.raises(MotionError, match="strictly increasing"):
        motion.select(np.array([4, 1]))


def test_empty_slice_is_refused(motion):
    with pytest.raises(MotionError, match="no frame left"):
        motion.slice(5.0, 6.0)


def spoil(array, row, column, value):
    out = np.array(array)
    out[row, column] = value
    return out


@pytest.mark.parametrize(
    ("change", "message", "index"),
    [
        (lambda m: {"time_s": np.r_[m.time_s[:5], m.time_s[4:-1]]}, "strictly increasing", 5),
        (lambda m: {"time_s": m.time_s[::-1]}, "strictly increasing", 1),
        (lambda m: {"time_s": np.r_[m.time_s[:-1], np.nan]}, "finite seconds", 11),
        (lambda m: {"time_s": np.empty(0)}, "at least one frame", None),
        (lambda m: {"q": m.q[:-1]}, "q: expected shape", None),
        (lambda m: {"v": m.v[:, :-1]}, "v: expected shape", None),
        (lambda m: {"q": spoil(m.q, 3, 20, np.nan)}, "q: expected finite", 3),
        (lambda m: {"a": spoil(m.a, 7, 0, np.inf)}, "a: expected finite", 7),
        (lambda m: {"q": spoil(m.q, 4, slice(3, 7), [0, 0, 0, 1.1])}, "norm 1, got 1.1", 4),
        (lambda m: {"q": spoil(m.q, 4, slice(3, 7), 0.0)}, "norm 1, got 0", 4),
        (lambda m: {"flags": {"odd": np.zeros(3, dtype=bool)}}, "flag 'odd'", None),
    ],
)
def test_malformed_motions_are_refused(motion, change, message, index):
    with pytest.raises(MotionError, match=message) as caught:
        replace(motion, **change(motion))
    assert caught.value.index == index


def test_survives_another_process(motion):
    there = pickle.loads(pickle.dumps(motion))
    np.testing.assert_array_equal(there.q, motion.q)
    assert there.provenance == motion.provenance
    assert dict(there.provenance.assumed) == {"legs": "not measured"}
    with pytest.raises(ValueError, match="read-only"):
        there.q[0, 0] = 0.0


def test_provenance_grows():
    first = Provenance("file", sha256="ab")
    second = first.then("scaled").then("filtered")
    assert second.steps == ("scaled", "filtered")
    assert first.steps == ()
    assert second.sha256 == "ab"
