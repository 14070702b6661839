"""An inspection says what the file holds, in values that JSON can carry."""

import hashlib
import json
from pathlib import Path

from human.readers import inspect_recording, write_bvh

from .making import walker, write_mvnx


def test_mvnx(tmp_path: Path) -> None:
    text = write_mvnx(tmp_path / "a.mvnx", *walker(), sensors=("Pelvis", "T8", "Head"))
    found = json.loads(json.dumps(inspect_recording(tmp_path / "a.mvnx").to_dict()))
    assert found["format"] == "mvnx"
    assert found["version"].startswith("4")
    assert found["sha256"] == hashlib.sha256(text.encode()).hexdigest()
    assert found["rate_hz"] == 60.0
    assert found["frames"] == 40
    assert abs(found["duration_s"] - 39 / 60) < 1e-9
    assert found["subject"]["label"] == "Made"
    assert 1.4 < found["subject"]["skeleton_height_m"] < 1.9
    assert found["subject"]["mass_kg"] is None
    assert found["segments"]["LeftHand"] == "unmeasured"
    assert found["channels"] == {"orientation": 42, "position": 42}
    assert found["aliases"] == {
        "jLeftT4Shoulder": "jLeftC7Shoulder",
        "jRightT4Shoulder": "jRightC7Shoulder",
    }
    assert [p["code"] for p in found["problems"]] == ["unmeasured-segments"]
    assert [n["code"] for n in found["notes"]] == ["reference-poses"]


def test_bvh(tmp_path: Path) -> None:
    write_bvh(tmp_path / "b.bvh", *walker())
    found = json.loads(json.dumps(inspect_recording(tmp_path / "b.bvh").to_dict()))
    assert found["format"] == "bvh"
    assert found["version"] == "Xsens skeleton"
    assert found["aliases"]["Hips"] == "Pelvis"
    assert "lengths from cm to m" in " ".join(found["conversions"])
    assert "up is +y" in " ".join(found["conversions"])
    assert found["problems"] == []
    assert [n["code"] for n in found["notes"]] == ["first-frame"]
