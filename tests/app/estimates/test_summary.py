"""What a long recording says again and again is said a few times and then counted."""

from app.estimates.summary import _gathered


def test_texts_that_differ_in_their_times_are_counted() -> None:
    gaps = [f"Carried over gaps of up to 0.{k} s: {k} frames" for k in range(20)]
    found = _gathered(["plate 1: idle", *gaps, "plate 1: idle", "no hands"])
    assert found[0] == "plate 1: idle" and "no hands" in found
    assert found[7].startswith("14 more like this: Carried") and len(found) == 9
