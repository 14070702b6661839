"""The grammar of BVH apart from what it means."""

from pathlib import Path

import numpy as np
import pytest

from human.readers.bvh_file import parse_bvh, snapped_frame_time

SMALL = """\ufeffHIERARCHY\r
ROOT Hips\r
{\r
  OFFSET 0 0 0\r
  CHANNELS 6 xposition YPOSITION Zposition Zrotation Xrotation Yrotation\r

  JOINT Tail Bone
  {
    OFFSET 1 2e0 -3
    CHANNELS 0
    End Site
    {
      OFFSET 0 0 1
    }
  }
}
MOTION
Frames:  2
Frame Time: 0.04
1 2 3 4 5 6

7 8 9 10 11 12
"""


def test_blank_lines_case_and_line_ends_do_not_matter(tmp_path: Path) -> None:
    (tmp_path / "a.bvh").write_bytes(SMALL.encode())
    file = parse_bvh(tmp_path / "a.bvh")
    assert [joint.name for joint in file.joints] == ["Hips", "Tail Bone"]
    assert file.joints[1].offset == (1.0, 2.0, -3.0)
    assert file.joints[1].end_offset == (0.0, 0.0, 1.0)
    assert file.joints[0].channels[:2] == ("Xposition", "Yposition")
    np.testing.assert_array_equal(file.values, [[1, 2, 3, 4, 5, 6], [7, 8, 9, 10, 11, 12]])
    assert file.frame_time_s == 0.04


@pytest.mark.parametrize(
    ("written", "used"),
    [
        ("0.016667", 1 / 60),
        ("0.0083333", 1 / 120),
        ("0.00833333", 1 / 120),
        (".0041667", 1 / 240),
        ("1.6667e-2", 1 / 60),
        ("0.04", 0.04),  # exact already
        ("0.0167", 1 / 60),
        ("0.017", 1 / 60),
        ("0.008", 0.008),  # 120 and 125 Hz both round to it: as written
        ("0.0123", 0.0123),
        ("1", 1.0),
    ],
)
def test_rounded_frame_times(written: str, used: float) -> None:
    got, note = snapped_frame_time(float(written), written)
    assert got == pytest.approx(used, abs=1e-15)
    assert bool(note) == (abs(float(written) - used) > 1e-12)
