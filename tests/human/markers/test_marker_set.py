"""Marker sets: those that come along, users' own, and telling which one a recording wears."""

import copy
from collections import Counter
from typing import Any

import pytest

from human.markers import (
    MarkerSet,
    MarkerSetError,
    UnknownMarkerSetError,
    known_marker_set,
    known_marker_sets,
    marker_set_from_dict,
    match_markers,
    recognise_marker_set,
)
from human.names import mirrored

MINE: dict[str, Any] = {
    "schema": 1,
    "name": "mine",
    "markers": [
        {"name": "hip.R", "segment": "Pelvis", "role": "right_asis", "also": ["HR"]},
        {"name": "thigh", "segment": "RightUpperLeg", "sd_m": 0.02},
        {"name": "knee centre", "segment": "RightUpperLeg", "tracked": False},
    ],
}


@pytest.mark.parametrize("marker_set", known_marker_sets(), ids=lambda s: s.name)
def test_a_known_set_shows_the_pelvis_and_the_same_points_on_both_sides(
    marker_set: MarkerSet,
) -> None:
    roles = marker_set.roles()
    assert {"right_asis", "left_asis", "right_psis", "left_psis"} <= roles
    arms = () if marker_set.name != "right-arm" else ("acromion", "elbow", "wrist", "hand")
    for role in roles:
        if not any(part in role for part in arms):
            other = role.replace("right", "?").replace("left", "right").replace("?", "left")
            assert other in roles
    # A marker on the wrong segment shows as a side with one more than the other.
    count = Counter(place.segment for place in marker_set.places if place.role)
    for segment in count:
        if not arms:
            assert count[segment] == count[mirrored(segment)]
    for place in marker_set.places:
        if place.role and place.role.startswith("right") and place.segment[:4] == "Left":
            pytest.fail(f"{place.name} shows a right point on {place.segment}")


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        ("LASI RASI LPSI RPSI LKNE RKNE LANK RANK LHEE RHEE LTOE RTOE", "cgm"),
        ("S1:LFWT S1:RFWT S1:LBWT S1:RBWT S1:LKNE S1:RKNE S1:RSHN S1:LSHN S1:C7", "cmu"),
        ("l_ias R_IAS L_IPS R_IPS L_FLE R_FLE L_FME R_FME L_FAL R_FAL", "isb"),
        (
            "r.ASIS_study L.ASIS_study r.PSIS_study L.PSIS_study r_knee_study L_knee_study",
            "opencap",
        ),
    ],
)
def test_a_set_is_told_by_the_names(names: str, expected: str) -> None:
    found = recognise_marker_set(names.split())
    assert found.marker_set.name == expected
    assert found.share == 1.0
    assert not found.unknown


def test_what_other_software_computed_is_no_marker() -> None:
    names = "LASI RASI LPSI RPSI LKNE RKNE LANK RANK".split()
    results = ["LKneeAngles", "PELO", "RTIA", "RHipMoment", "CentreOfMass"]
    found = recognise_marker_set([*names, *results, "box1"])
    assert found.results == tuple(results)
    assert found.unknown == ("box1",)
    assert found.share == pytest.approx(8 / 9)
    assert "RHEE" in found.missing and "RKNE" not in found.missing


def test_a_second_marker_of_the_same_name_is_left_out() -> None:
    names = [f"A:{n}" for n in "LASI RASI LPSI RPSI LKNE RKNE".split()]
    assert recognise_marker_set([*names, "B:LASI"]).unknown == ("B:LASI",)


def test_nobody_is_given_the_markers_of_another() -> None:
    names = "LASI RASI LPSI RPSI LKNE RKNE LANK".split()
    both = [f"A:{n}" for n in names[:6]] + [f"B:{n}" for n in names]
    found = match_markers(both, known_marker_set("cgm"))
    assert set(found.place_of) == {f"B:{n}" for n in names}
    assert found.others == ("A",)
    # A name without a prefix may be anybody's.
    alone = match_markers([*both[:6], "LANK"], known_marker_set("cgm"))
    assert "LANK" in alone.place_of and not alone.others


@pytest.mark.parametrize("names", [[], ["M001", "M002", "M003"], ["LASI", "RASI", "LPSI", "RPSI"]])
def test_unknown_markers_are_refused_by_name(names: list[str]) -> None:
    with pytest.raises(UnknownMarkerSetError, match="mapping file") as error:
        recognise_marker_set(names)
    assert all(name in str(error.value) for name in names)


def test_a_users_own_set() -> None:
    mine = marker_set_from_dict(MINE)
    asis, thigh, centre = mine.places
    assert (asis.role, thigh.sd_m, centre.tracked) == ("right_asis", 0.02, False)
    assert mine.find("Ann:HIP_R") is mine.find("hr") is asis
    assert mine.find("hip.L") is None


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"schema": 2}, "schema"),
        ({"markers": []}, "markers"),
        ({"colour": "red"}, "file"),
        ({"name": ""}, "name"),
        ({"pelvis_dip_deg": "steep"}, "pelvis_dip_deg"),
        ({"not_markers": "X*"}, "not_markers"),
        ({0: {"segment": "Hip"}}, r"markers\[0\] \(hip.R\)"),
        ({0: {"role": "nose"}}, r"markers\[0\]"),
        ({1: {"sd_m": 20}}, r"markers\[1\] \(thigh\), sd_m"),
        ({1: {"sd_m": float("nan")}}, r"markers\[1\] \(thigh\), sd_m"),
        ({1: {"name": 7}}, r"markers\[1\].name"),
        ({1: {"name": "--"}}, "--"),
        ({1: {"name": "HIP R"}}, "HIP R"),
        ({1: {"role": "right_asis"}}, "markers"),
        ({2: {"tracked": 1}}, r"markers\[2\]"),
        ({2: {"also": [None]}}, r"markers\[2\] \(knee centre\).also"),
    ],
)
def test_a_malformed_set_is_refused_with_its_place(change: dict[Any, Any], place: str) -> None:
    value = copy.deepcopy(MINE)
    for key, new in change.items():
        if isinstance(key, int):
            value["markers"][key].update(new)
        else:
            value[key] = new
    with pytest.raises(MarkerSetError, match=f"^marker set, {place}"):
        marker_set_from_dict(value)


def test_a_known_set_by_name() -> None:
    assert known_marker_set("cmu").pelvis_dip_deg == 0.0
    with pytest.raises(MarkerSetError, match="opencap"):
        known_marker_set("vicon")
