"""The page of a recording: drop it, see its worst moments."""

import pytest
from playwright.sync_api import Page, expect

from tests.browser import scene
from tests.browser.conftest import Watched, drawn

BVH = {"name": "lifting.bvh", "mimeType": "application/octet-stream", "buffer": b"HIERARCHY\n"}
NOT_BVH = {"name": "notes.txt", "mimeType": "text/plain", "buffer": b"dear diary"}


@pytest.fixture
def score_page(watched: Watched, mock_address: str) -> Page:
    watched.page.goto(f"{mock_address}#/recording")
    expect(watched.page.get_by_role("heading", level=1)).to_have_text("Score a recording")
    return watched.page


def drop(page: Page, file: dict[str, object]) -> None:
    page.locator("ec-score-page ec-file-drop input").set_input_files(file)  # type: ignore[arg-type]


def playback_time(page: Page) -> float:
    return float(page.locator("ec-transport").evaluate("bar => bar.playback.time"))


def test_a_dropped_recording_is_scored_and_played(score_page: Page) -> None:
    drop(score_page, BVH)
    drawn(score_page)
    expect(score_page.get_by_role("heading", level=1)).to_contain_text("RULA is 5 or above for")
    expect(score_page.get_by_role("heading", level=1)).to_contain_text("worst 6 at 1.0 s")
    moments = score_page.get_by_role("region", name="Worst moments").get_by_role("button")
    expect(moments.first).to_contain_text("Right trunk bent 57°")
    expect(moments.first.locator(".more")).to_have_text("upper arm raised")
    moments.first.click()
    assert playback_time(score_page) == pytest.approx(1.0)
    bent = score_page.locator("ec-figure").evaluate("body => body.angleOf('jL5S1_roty')")
    assert bent == pytest.approx(1.0 / 3.0, abs=1e-6)
    expect(score_page.locator("ec-chart").first.locator("output")).to_have_text(
        "6  (left 3, right 6)"
    )
    expect(score_page.locator("ec-assumed")).to_contain_text("0 to 10")
    score_page.locator("body").press("ArrowRight")
    assert playback_time(score_page) == pytest.approx(1.05)


def test_the_load_that_is_typed_in_is_sent(score_page: Page) -> None:
    score_page.get_by_label("Load in both hands").fill("6")
    score_page.get_by_label("Height").fill("1.81")
    with score_page.expect_request("**/v1/scores") as sent:
        drop(score_page, BVH)
    assert sent.value.post_data_json == {
        "recording_id": scene.RECORDING["id"],
        "hand_load_kg": 6,
        "height_m": 1.81,
    }
    expect(score_page.get_by_role("heading", level=1)).to_contain_text("worst 7")


def test_one_sent_before_can_be_scored_again(score_page: Page) -> None:
    score_page.get_by_label("Or one sent before").select_option(scene.RECORDING["id"])
    score_page.get_by_role("button", name="Score", exact=True).click()
    expect(score_page.locator("ec-player")).to_be_visible()
    score_page.get_by_text("Another recording or load").click()
    expect(score_page.get_by_role("button", name="lifting.bvh")).to_be_visible()


def test_a_file_that_is_no_recording_is_refused_in_words(score_page: Page) -> None:
    drop(score_page, NOT_BVH)
    expect(score_page.get_by_role("alert")).to_contain_text("Not a motion recording")
    expect(score_page.get_by_role("alert")).to_contain_text("neither MVNX nor BVH")
    expect(score_page.get_by_role("heading", level=1)).to_have_text("Score a recording")
