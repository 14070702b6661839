"""The page over the real service: what it draws is what the service predicted."""

import json
import socket
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest
import uvicorn
from playwright.sync_api import Page, expect

from app.main import create_app
from app.settings import Settings
from human import SEGMENTS, forward_kinematics
from tests.app.conftest import Scene, bvh, lifting, scene
from tests.app.estimates.lifting import BOX_KG, EMPTY_S, PERSON, Lifting
from tests.browser.conftest import Watched, drawn

__all__ = ["bvh", "lifting", "scene"]  # fixtures of the service's own tests

FAULTY = "through-the-floor"


@dataclass(frozen=True)
class Running:
    """The service with one assessment in it."""

    address: str
    request: dict[str, Any]
    assessment: dict[str, Any]

    def posture(self, candidate: str) -> dict[str, Any]:
        url = f"{self.address}v1/assessments/{self.assessment['id']}/candidates/{candidate}/posture"
        answer: dict[str, Any] = httpx2.get(url).raise_for_status().json()
        return answer


@pytest.fixture(scope="session")
def running(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """The service on a free port, with a small operator and an assessment."""
    listener = socket.create_server(("127.0.0.1", 0))
    address = f"http://127.0.0.1:{listener.getsockname()[1]}/"
    app = create_app(Settings(data=tmp_path_factory.mktemp("data"), api_keys=""))
    server = uvicorn.Server(uvicorn.Config(app, log_level="error", ws="none"))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
    thread.start()
    while not server.started:
        assert thread.is_alive(), "the service did not start"
        time.sleep(0.02)
    model = httpx2.post(
        f"{address}v1/models?name=ada",
        content=scene.file.read_bytes(),
        headers={"content-type": "application/vnd.ergocast.model"},
    ).raise_for_status()
    request = scene.request(model.json()["id"])
    fault = {**request["candidates"][0], "id": FAULTY}
    fault["position_m"] = [[x, y, z - 3.0] for x, y, z in fault["position_m"]]
    request["candidates"] = [*request["candidates"], fault]
    answer = httpx2.post(f"{address}v1/assessments", json=request, timeout=60.0)
    yield Running(address, request, answer.raise_for_status().json())
    server.should_exit = True
    thread.join()
    listener.close()


@pytest.fixture
def page(watched: Watched, running: Running) -> Page:
    watched.page.goto(running.address)
    drawn(watched.page)
    return watched.page


def test_the_answer_and_the_order_are_the_services(page: Page, running: Running) -> None:
    candidates = running.assessment["candidates"]
    order = sorted((c for c in candidates if c["rank"]), key=lambda c: c["rank"])
    rows = page.locator("[data-candidate]")
    shown = [rows.nth(i).get_attribute("data-candidate") for i in range(rows.count())]
    assert shown == [*(c["id"] for c in order), FAULTY]
    expect(page.get_by_role("heading", level=1)).to_contain_text(order[0]["id"])
    problem = next(c["problem"] for c in candidates if c["id"] == FAULTY)
    expect(page.locator(f"[data-candidate={FAULTY}]")).to_contain_text(problem["detail"])


def test_every_joint_stands_where_the_services_own_kinematics_put_it(
    page: Page, running: Running, scene: Scene
) -> None:
    chosen = running.assessment["candidates"][0]["id"]
    page.locator(f"[data-candidate={chosen}]").click()
    expect(page.get_by_text("Loading…")).to_have_count(0)
    posture = running.posture(chosen)
    base = np.hstack([posture["base"]["position_m"], posture["base"]["orientation_xyzw"]])
    poses = forward_kinematics(scene.model, np.hstack([base, posture["joint_position"]]))
    body = page.locator("ec-figure")
    for frame in (0, len(base) // 2, len(base) - 1):
        page.locator("ec-transport").evaluate(
            "(bar, time) => bar.playback.seek(time)", posture["time_s"][frame]
        )
        for joint, segment in (
            ("jRightWrist", "RightHand"),
            ("jRightShoulder", "RightUpperArm"),
            ("jC1Head", "Head"),
            ("jLeftAnkle", "LeftFoot"),
        ):
            drawn_at = body.evaluate("(body, joint) => body.placeOf(joint)", joint)
            expected = poses.position[frame, SEGMENTS.index(segment)]
            assert np.allclose(drawn_at, expected, atol=1e-4), (frame, joint)


def test_colours_are_the_efforts_on_their_scale(page: Page, running: Running) -> None:
    best = min((c for c in running.assessment["candidates"] if c["rank"]), key=lambda c: c["rank"])
    posture = running.posture(best["id"])
    page.locator("ec-transport").evaluate("bar => bar.playback.seek(0)")
    share = {
        joint: efforts[0] / posture["effort_scale_nm"][joint]
        for joint, efforts in posture["effort_p50_nm"].items()
    }
    shown = page.locator("ec-figure").evaluate(
        "(body, joints) => joints.map(joint => body.colourOf(joint)[1])", list(share)
    )
    # Green falls steadily along the ramp: the order of the colours is the order of the efforts.
    by_share = np.argsort(list(share.values()), kind="stable")
    assert np.all(np.diff(np.array(shown)[by_share]) <= 1)
    assert np.ptp(shown) > 100 * np.ptp(list(share.values()))
    assert set(share) == set(best["effort_nm"])


def test_a_malformed_request_is_refused_with_its_place(page: Page, running: Running) -> None:
    page.get_by_role("button", name="Open request").click()
    text = page.get_by_label("Request as JSON")
    text.fill(json.dumps({**running.request, "payload_kg": -1}))
    page.get_by_role("button", name="Assess", exact=True).click()
    expect(page.get_by_role("alert")).to_contain_text("/payload_kg")
    text.fill(json.dumps({**running.request, "model_id": "nobody"}))
    page.get_by_role("button", name="Assess", exact=True).click()
    expect(page.get_by_role("alert")).to_contain_text("nobody")


def test_a_request_is_assessed_and_shown(page: Page, running: Running) -> None:
    page.get_by_role("button", name="Open request").click()
    two = {**running.request, "candidates": running.request["candidates"][:2], "name": "Two ways"}
    file = {"name": "two.json", "mimeType": "application/json", "buffer": json.dumps(two).encode()}
    page.locator("ec-request-dialog ec-file-drop input").set_input_files(file)  # type: ignore[arg-type]
    expect(page.get_by_role("dialog")).to_have_count(0)
    expect(page.locator("[data-candidate]")).to_have_count(2)
    expect(page.get_by_label("Assessment")).to_contain_text("Two ways")


def test_a_recording_is_scored_and_its_worst_moment_shown(page: Page, bvh: Path) -> None:
    page.get_by_role("link", name="Recording").click()
    page.get_by_label("Height").fill("1.72")
    page.get_by_label("Mass").fill("68")
    page.locator("ec-score-page ec-file-drop input").set_input_files(bvh)
    drawn(page)
    expect(page.get_by_role("heading", level=1)).to_contain_text("RULA")
    moments = page.get_by_role("region", name="Worst moments").get_by_role("button")
    assert moments.count() > 1
    expect(moments.last).to_have_attribute("aria-current", "false")
    moments.last.click()
    expect(moments.last).to_have_attribute("aria-current", "true")
    expect(page.locator("ec-assumed")).to_contain_text("What that would change")


def test_a_box_on_plates_is_weighed_and_the_figures_are_the_services(
    page: Page, running: Running, lifting: Lifting
) -> None:
    page.get_by_role("link", name="Forces and payload").click()
    files = {"motion": lifting.motion, "static": lifting.static, "grf": lifting.grf}
    for role, file in files.items():
        page.locator(f"[data-role={role}] input").set_input_files(file)
    page.get_by_label("Height").fill(str(PERSON.height_m))
    page.get_by_label("Mass").fill(str(PERSON.mass_kg))
    page.get_by_label("Tare from").fill(str(EMPTY_S[0]))
    page.get_by_label("Tare to").fill(str(EMPTY_S[1]))
    page.get_by_role("button", name="Estimate").click()
    drawn(page)
    estimate = httpx2.get(f"{running.address}v1/estimates/{page.url.split('/')[-1]}").json()
    assert estimate["options"]["tare_s"] == list(EMPTY_S)
    (held,) = (hold for hold in estimate["holds"] if hold["state"] == "loaded")
    mass = held["mass_kg"]["p50"]
    assert mass == pytest.approx(BOX_KG, abs=0.3)
    expect(page.get_by_role("heading", level=1)).to_contain_text(f"{mass:.2f} kg")
    holds = page.get_by_role("region", name="Payload by hold")
    expect(holds).to_contain_text("only the sum can be told")
    for said in estimate["assumed"]:
        expect(page.get_by_role("listitem").filter(has_text=said).first).to_be_visible()
    # The body stands where the service's columns put it, and bears what they say.
    time_s = page.locator("ec-transport").evaluate("bar => bar.playback.time")
    wanted = "jRightElbow_rotz_angle_rad,payload_p50_kg"
    url = f"{running.address}{estimate['series_url'][1:]}?columns={wanted}&start={time_s - 1e-6}"
    columns = httpx2.get(url).json()["columns"]
    assert columns["time_s"][0] == pytest.approx(time_s)
    angle = page.locator("ec-figure").evaluate("body => body.angleOf('jRightElbow_rotz')")
    assert angle == pytest.approx(columns["jRightElbow_rotz_angle_rad"][0], abs=1e-5)
    payload = page.locator("ec-chart").filter(has_text="Payload").locator("output")
    expect(payload).to_contain_text(f"{columns['payload_p50_kg'][0]:.2f} kg")


def test_a_file_that_is_no_recording_is_refused(page: Page, tmp_path: Path) -> None:
    page.get_by_role("link", name="Recording").click()
    bomb = tmp_path / "bomb.mvnx"
    bomb.write_text('<!DOCTYPE a [<!ENTITY b "b"><!ENTITY c "&b;&b;">]><mvnx>&c;</mvnx>')
    page.locator("ec-score-page ec-file-drop input").set_input_files(bomb)
    expect(page.get_by_role("alert")).to_be_visible()
    expect(page.get_by_role("heading", level=1)).to_have_text("Score a recording")
