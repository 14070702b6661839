"""Mirrored and side-swapped files are noticed and refused, whichever way they came about."""

import re
from pathlib import Path

import numpy as np
import pytest

from human.names import mirrored
from human.pose import RecordingRefusedError, fit_recording
from human.readers import inspect_recording, read_recording, write_bvh

from .making import CMU_NAMES, PERSON, walker, write_mvnx, write_other_bvh


def swapped_joint_names(folder: Path) -> Path:
    """A BVH whose left joints carry the right side's names."""
    names = {s: CMU_NAMES[mirrored(s)] for s in CMU_NAMES}
    write_other_bvh(folder / "a.bvh", *walker(), names=names)
    return folder / "a.bvh"


def mirrored_world(folder: Path) -> Path:
    """A BVH with one axis of skeleton and world turned round: a left-handed file."""
    model, motion = walker()
    write_other_bvh(folder / "a.bvh", model, motion, unit_m=0.01)
    out = []
    for line in (folder / "a.bvh").read_text().splitlines():
        words = line.split()
        if words[:1] == ["OFFSET"]:
            line = f"OFFSET {-float(words[1])} {words[2]} {words[3]}"
        elif len(words) > 20:
            values = [float(word) for word in words]
            values[0] = -values[0]
            # Mirroring x turns the sense of rotations about y and z; channels are Z Y X.
            rotations = np.reshape(values[3:], (-1, 3)) * [-1.0, -1.0, 1.0]
            line = " ".join(f"{v:.6f}" for v in [*values[:3], *np.ravel(rotations)])
        out.append(line)
    (folder / "a.bvh").write_text("\n".join(out) + "\n")
    return folder / "a.bvh"


def swapped_channels(folder: Path) -> Path:
    """A BVH whose arms and legs were given each other's angles."""
    model, motion = walker()
    write_bvh(folder / "a.bvh", model, motion)
    head, rows = (folder / "a.bvh").read_text().split("Frame Time:")
    names = re.findall(r"(?:ROOT|JOINT) (\S+)", head)
    order = [names.index(mirrored(name)) for name in names]
    first, *frames = rows.strip().splitlines()
    out = []
    for row in frames:
        values = np.array(row.split(), dtype=float)
        angles = values[3:].reshape(-1, 3)[order]
        out.append(" ".join(f"{v:.6f}" for v in [*values[:3], *angles.ravel()]))
    (folder / "a.bvh").write_text(f"{head}Frame Time: {first}\n" + "\n".join(out) + "\n")
    return folder / "a.bvh"


def swapped_segment_labels(folder: Path) -> Path:
    """An MVNX whose right and left are exchanged in every label."""
    text = write_mvnx(folder / "a.mvnx", *walker())
    text = text.replace("Right", "\0").replace("Left", "Right").replace("\0", "Left")
    (folder / "a.mvnx").write_text(text)
    return folder / "a.mvnx"


@pytest.mark.parametrize(
    "make", [swapped_joint_names, mirrored_world, swapped_channels, swapped_segment_labels]
)
def test_exchanged_sides_are_noticed_and_refused(tmp_path: Path, make) -> None:
    path = make(tmp_path)
    problems = inspect_recording(path).problems
    assert [(p.code, p.severity) for p in problems] == [("sides", "error")]
    recording = read_recording(path)
    with pytest.raises(RecordingRefusedError, match="accept by name: sides"):
        fit_recording(recording, PERSON)


def test_an_exchange_is_fitted_only_when_accepted_and_is_marked(tmp_path: Path) -> None:
    recording = read_recording(swapped_channels(tmp_path))
    fitted = fit_recording(recording, PERSON, accept=("sides",))
    assert "accepted" in fitted.motion.provenance.assumed["sides"]


def test_positions_mirrored_alone_are_inconsistent(tmp_path: Path) -> None:
    text = write_mvnx(tmp_path / "a.mvnx", *walker())

    def flip(match: re.Match[str]) -> str:
        values = np.array(match[1].split(), dtype=float).reshape(-1, 3) * [1.0, -1.0, 1.0]
        return "<position>" + " ".join(f"{v:.6f}" for v in values.ravel()) + "</position>"

    (tmp_path / "a.mvnx").write_text(re.sub(r"<position>([^<]*)</position>", flip, text))
    recording = read_recording(tmp_path / "a.mvnx")
    assert "inconsistent" in [f.code for f in recording.errors]
    with pytest.raises(RecordingRefusedError, match="inconsistent"):
        fit_recording(recording, PERSON)


def test_an_honest_file_raises_no_suspicion(tmp_path: Path) -> None:
    for seed in range(5):
        write_bvh(tmp_path / "a.bvh", *walker(seed=seed))
        assert inspect_recording(tmp_path / "a.bvh").problems == []
        write_mvnx(tmp_path / "a.mvnx", *walker(seed=seed))
        assert inspect_recording(tmp_path / "a.mvnx").problems == []
