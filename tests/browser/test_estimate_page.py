"""The page of an estimate: drop the files, follow or stop the work, see what the body bore."""

import re

import pytest
from playwright.sync_api import FilePayload, Page, expect

from tests.browser import scene
from tests.browser.conftest import Watched, drawn
from tests.browser.estimate_scene import ASSUMED, FINDINGS
from tests.browser.mock_service import ENDLESS_M, FAILING_M

MOTION: FilePayload = {
    "name": "lifting.bvh",
    "mimeType": "application/octet-stream",
    "buffer": b"HIERARCHY\n",
}
PLATES: FilePayload = {
    "name": "plates.mot",
    "mimeType": "application/octet-stream",
    "buffer": b"nRows=1\n",
}


@pytest.fixture
def start(watched: Watched, mock_address: str) -> Page:
    watched.page.goto(mock_address)
    watched.page.get_by_role("link", name="Forces and payload").click()
    expect(watched.page.get_by_role("heading", level=1)).to_have_text("What did the body bear?")
    return watched.page


@pytest.fixture
def shown(watched: Watched, mock_address: str) -> Page:
    watched.page.goto(f"{mock_address}#/estimates/e-demo")
    drawn(watched.page)
    return watched.page


def drop(page: Page, role: str, file: FilePayload) -> None:
    page.locator(f"[data-role={role}] input").set_input_files(file)


def seek(page: Page, time_s: float) -> None:
    page.locator("ec-transport").evaluate("(bar, time) => bar.playback.seek(time)", time_s)


def reading(page: Page, label: str) -> str:
    chart = page.locator("ec-chart").filter(has_text=label).first
    return str(chart.locator("output").text_content())


def test_files_by_role_are_sent_and_the_answer_is_shown(start: Page) -> None:
    drop(start, "motion", MOTION)
    drop(start, "grf", PLATES)
    start.get_by_label("Height").fill("1.76")
    start.get_by_label("Tare from").fill("0.2")
    start.get_by_label("Tare to").fill("0.8")
    with (
        start.expect_request("**/files?role=grf&name=plates.mot"),
        start.expect_request("**/v1/estimates") as asked,
    ):
        start.get_by_role("button", name="Estimate").press("Enter")
    assert asked.value.post_data_json == {
        "recording_id": scene.RECORDING["id"],
        "height_m": 1.76,
        "sex": "unknown",
        "hands": "auto",
        "definition": "inertial",
        "bands": "noise_and_model",
        "tare_s": [0.2, 0.8],
    }
    bar = start.get_by_role("progressbar", name="Progress")
    expect(bar).to_have_attribute("max", "1")
    drawn(start)
    assert start.url.endswith("#/estimates/e-demo")
    expect(start.get_by_role("heading", level=1)).to_have_text(
        "5.00 kg (4.60 to 5.40) in the hands from 1.0 s to 3.0 s, the most of 2 holds"
    )
    expect(start.locator(".answer")).to_contain_text("1.20 kg more than the body’s 72.0 kg")
    start.get_by_text("Another recording or setting").click()
    expect(start.get_by_label("Tare from")).to_have_value("0.2")


def test_what_is_known_and_what_is_not_is_told_apart(shown: Page) -> None:
    holds = shown.get_by_role("region", name="Payload by hold").get_by_role("button")
    expect(holds.nth(1)).to_contain_text("only the sum can be told")
    expect(holds.nth(2)).to_contain_text("right 2.00 kg, left 0.00 kg")
    expect(holds.first).not_to_contain_text("only the sum")
    holds.nth(2).click()
    assert reading(shown, "Payload") == "2.00 kg  (1.50–2.50); right 2.00, left 0"
    seek(shown, 2.0)
    assert reading(shown, "Payload") == "5.00 kg  (4.50–5.50)"
    seek(shown, 6.5)
    for label in ("Payload", "force", "moment", "Mid spine"):
        assert reading(shown, label) == "cannot be told"
    assert reading(shown, "Feet") == "right 350 N, left ?"
    right = shown.get_by_role("img", name="The right hand: free")
    expect(right).to_have_attribute(
        "aria-label",
        re.compile(r"unknown 1.0 to .*, free .*, loaded 4.0 to .*, free"),
    )
    for text in (*ASSUMED, *FINDINGS):
        expect(shown.get_by_role("listitem").filter(has_text=text)).to_be_visible()


def test_the_unknown_stretch_is_hatched_and_no_curve_crosses_it(shown: Page) -> None:
    chart = shown.locator("ec-chart").first
    shades = chart.evaluate("it => it.shades.map(s => [s.kind, s.from, s.to])")
    assert shades == [
        ["doubtful", pytest.approx(3.2), pytest.approx(3.6)],
        ["unknown", pytest.approx(6.0), pytest.approx(7.0)],
    ]
    # Pixels of the accent's own blue in the middle of the stretch, and of anything at all.
    seen = chart.evaluate(
        """it => {
          const canvas = it.renderRoot.querySelector("canvas");
          const { data } = canvas
            .getContext("2d")
            .getImageData(0, 0, canvas.width, canvas.height);
          const of = time => {
            const left = 48 * devicePixelRatio;
            const width = canvas.width - left - 8 * devicePixelRatio;
            const x = Math.round(left + width * time / 8);
            let blue = 0, inked = 0;
            for (let y = 8; y < canvas.height - 12; y++) {
              const first = 4 * (y * canvas.width + x - 3);
              for (let i = first; i < first + 24; i += 4) {
                if (data[i + 3] > 0) inked++;
                if (data[i + 3] > 40 && data[i + 2] > data[i] + 60) blue++;
              }
            }
            return [blue, inked];
          };
          return { unknown: of(6.5), known: of(5.5) };
        }"""
    )
    assert seen["known"][0] > 0
    assert seen["unknown"][0] == 0
    assert seen["unknown"][1] > 100


def test_a_peak_leads_to_its_joint_and_time(shown: Page) -> None:
    peaks = shown.get_by_role("region", name="Greatest efforts")
    seek(shown, 0.0)
    peaks.get_by_role("button", name="Right hip").press("Enter")
    assert shown.locator("ec-transport").evaluate("bar => bar.playback.time") == 1.5
    expect(shown.locator("ec-figure .label")).to_have_text("Right hip 60.0 N·m")
    seek(shown, 6.5)
    expect(shown.locator("ec-figure .label")).to_be_hidden()
    shown.locator("body").press("ArrowRight")
    assert shown.locator("ec-transport").evaluate("bar => bar.playback.time") == pytest.approx(6.55)
    with shown.expect_download() as download:
        shown.get_by_role("link", name="Parquet").click()
    assert download.value.path().read_bytes() == b"PAR1"


def test_the_work_can_be_cancelled(start: Page) -> None:
    start.get_by_label("Or one sent before").select_option(scene.RECORDING["id"])
    start.get_by_label("Height").fill(str(ENDLESS_M))
    start.get_by_role("button", name="Estimate").click()
    expect(start.get_by_role("status")).to_have_text("Fitting the body…")
    with start.expect_request("**/v1/operations/o-demo/cancel"):
        start.get_by_role("button", name="Cancel").click()
    expect(start.get_by_role("button", name="Estimate")).to_be_visible()
    expect(start.get_by_role("alert")).to_have_count(0)
    expect(start.get_by_label("Height")).to_have_value(str(ENDLESS_M))


def test_what_is_wrong_is_said_in_words(start: Page) -> None:
    start.get_by_label("Tare from").fill("3")
    start.get_by_role("button", name="Estimate").click()
    alert = start.get_by_role("alert")
    for words in ("There is no motion yet", "The height is missing", "one of them is missing"):
        expect(alert).to_contain_text(words)
    start.get_by_label("Tare from").fill("")
    drop(start, "motion", MOTION)
    start.get_by_label("Height").fill(str(FAILING_M))
    start.get_by_role("button", name="Estimate").click()
    expect(alert).to_contain_text("expected a column 'time', got 'zeit'")
    expect(start.get_by_role("button", name="Motion: lifting.bvh")).to_be_visible()


def test_an_address_of_no_estimate_says_so(watched: Watched, mock_address: str) -> None:
    watched.page.goto(f"{mock_address}#/estimates/e-gone")
    expect(watched.page.get_by_role("alert")).to_contain_text("Nothing at /v1/estimates/e-gone")
    expect(watched.page.get_by_role("button", name="Estimate")).to_be_visible()


@pytest.mark.parametrize("width", [400, 900])
def test_a_narrow_window_needs_no_sideways_scrolling(shown: Page, width: int) -> None:
    shown.set_viewport_size({"width": width, "height": 850})
    assert shown.evaluate("document.documentElement.scrollWidth") <= width
