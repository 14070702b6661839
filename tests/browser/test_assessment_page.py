"""The page of an assessment, in a real browser, over a scene whose every number is known."""

import re

import numpy as np
import pytest
from playwright.sync_api import Browser, Locator, Page, Route, expect

from human.names import DOF_NAMES
from tests.browser import scene
from tests.browser.conftest import Watched, drawn

FIGURE = "ec-figure"


def figure(page: Page) -> Locator:
    return page.locator(FIGURE)


def angle(page: Page, dof: str) -> float:
    return float(figure(page).evaluate("(body, dof) => body.angleOf(dof)", dof))


def colour(page: Page, joint: str) -> list[int]:
    found: list[int] = figure(page).evaluate("(body, joint) => body.colourOf(joint)", joint)
    return found


def time_shown(page: Page) -> float:
    return float(page.locator("ec-transport").evaluate("bar => bar.playback.time"))


def choose(page: Page, candidate: str) -> None:
    page.locator(f"[data-candidate={candidate}]").click()
    expect(page.locator(f"[data-candidate={candidate}]")).to_have_attribute("aria-selected", "true")
    expect(page.get_by_text("Loading…")).to_have_count(0)


def seek(page: Page, time: float) -> None:
    page.locator("ec-transport").evaluate("(bar, time) => bar.playback.seek(time)", time)


def test_answers_in_a_sentence_with_its_reason(page: Page) -> None:
    expect(page.get_by_role("heading", level=1)).to_have_text(
        "Take chest-high: least load, 78 % sure"
    )
    expect(page.locator(".answer")).to_contain_text("What decides over close-in")
    expect(page.locator(".answer")).to_contain_text("1 of 5 could not be assessed")


def test_ranks_the_candidates_and_marks_ties_strangers_and_faults(page: Page) -> None:
    rows = page.get_by_role("option").and_(page.locator("[data-candidate]"))
    order = [rows.nth(i).get_attribute("data-candidate") for i in range(rows.count())]
    assert order == ["chest-high", "close-in", "overhead-far", "low-side", "behind-the-post"]
    expect(rows.nth(0)).to_contain_text("78 %")
    expect(rows.nth(2)).to_contain_text("ties with low-side")
    expect(rows.nth(2)).to_contain_text("unfamiliar postures")
    expect(rows.nth(4)).to_contain_text("Out of reach")
    expect(rows.nth(4)).to_contain_text("0.31 m beyond")


def test_cost_parts_are_as_long_as_what_they_add(page: Page) -> None:
    widths = {}
    for name, *_ in scene.CANDIDATES[:4]:
        parts = page.locator(f"[data-candidate={name}] .cost span")
        widths[name] = [parts.nth(i).bounding_box()["width"] for i in range(parts.count())]  # type: ignore[index]
    made = {c["id"]: c["cost"] for c in scene.assessment()["candidates"] if c["cost"]}
    longest = max(sum(w) for w in widths.values())
    dearest = max(cost["total"] for cost in made.values())
    for name, parts_px in widths.items():
        shares = [p["contribution"] / dearest for p in made[name]["parts"]]
        assert np.allclose(np.array(parts_px) / longest, shares, atol=0.02), name


def test_the_body_stands_as_predicted_between_frames_too(page: Page) -> None:
    q = scene.joint_positions(0.12, 0.9)
    times = np.linspace(0.0, scene.DURATION_S, scene.FRAMES)
    for time in (0.0, 0.513, 1.0):
        seek(page, time)
        for dof in ("jRightShoulder_rotx", "jL5S1_roty", "jRightElbow_rotz"):
            expected = np.interp(time, times, q[:, DOF_NAMES.index(dof)])
            assert angle(page, dof) == pytest.approx(expected, abs=1e-6)


def test_the_drawn_hand_is_on_the_path_that_the_robot_asks_for(page: Page) -> None:
    choose(page, "low-side")
    path = scene.hand_path(scene.joint_positions(1.0, 0.5))
    for frame in (0, 13, 20, 40):
        seek(page, frame * scene.DURATION_S / (scene.FRAMES - 1))
        drawn_hand = figure(page).evaluate("body => body.placeOf('jRightWrist')")
        assert np.allclose(drawn_hand, path[frame], atol=1e-6)


def test_choosing_a_candidate_changes_body_plots_and_address(page: Page) -> None:
    seek(page, 1.0)
    before = angle(page, "jL5S1_roty")
    curve = "chart => chart.lines.find(line => line.kind === 'main').values[20]"
    rula = page.locator("ec-chart").first
    low = rula.evaluate(curve)
    choose(page, "low-side")
    page.wait_for_function(
        f"() => location.hash.endsWith('low-side') && document.querySelector('ec-app').renderRoot"
        f".querySelector('ec-assessment-page').player.figure.angleOf('jL5S1_roty') > {before + 0.1}"
    )
    assert angle(page, "jL5S1_roty") == pytest.approx(1.0 / 3.0, abs=1e-6)
    assert rula.evaluate(curve) > low + 1.0
    page.reload()
    drawn(page)
    expect(page.locator("[data-candidate=low-side]")).to_have_attribute("aria-selected", "true")


def test_play_moves_the_body_and_pause_holds_it(page: Page) -> None:
    seek(page, 0.2)
    start = angle(page, "jRightShoulder_rotx")
    page.get_by_role("button", name="Play").click()
    page.wait_for_function(
        "() => document.querySelector('ec-app').renderRoot.querySelector('ec-assessment-page')"
        ".playback.time > 0.45"
    )
    page.get_by_role("button", name="Pause").click()
    held = time_shown(page)
    assert held < scene.DURATION_S
    assert abs(angle(page, "jRightShoulder_rotx") - start) > 0.05
    page.wait_for_timeout(120)
    assert time_shown(page) == held
    page.locator("ec-transport").evaluate("bar => { bar.playback.rate = 4; bar.playback.play(); }")
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    assert time_shown(page) == scene.DURATION_S


def test_joint_colours_follow_effort_and_reach_the_screen(page: Page) -> None:
    seek(page, 0.0)
    pale = sum(colour(page, "jL5S1"))
    choose(page, "low-side")
    seek(page, 1.0)
    dark = sum(colour(page, "jL5S1"))
    assert dark < pale - 200, "the largest effort of all must be far darker than a small one"
    assert colour(page, "jRightHip") is None, "a joint without an effort must not claim one"
    pixel = figure(page).evaluate("body => body.pixelAt('jRightElbow')")
    assert np.abs(np.array(pixel) - colour(page, "jRightElbow")).max() <= 3
    legend = page.locator(".legend")
    expect(legend).to_contain_text("N·m")
    expect(legend).to_contain_text("121")


def test_a_worst_moment_is_one_click_away(page: Page) -> None:
    moments = page.get_by_role("region", name="Worst moments").get_by_role("button")
    expect(moments).to_have_count(3)
    assert time_shown(page) == 1.0, "the first look falls on the worst"
    expect(moments.nth(1)).to_have_text(re.compile(r"3.5\s+0.75 s\s+Trunk bent 5 deg"))
    moments.nth(1).click()
    assert time_shown(page) == pytest.approx(0.75)
    expect(moments.nth(1)).to_have_attribute("aria-current", "true")
    expect(figure(page).locator(".label")).to_contain_text("Low back")
    expect(page.get_by_label("Joint")).to_have_value("jL5S1")
    moments.nth(2).click()
    assert time_shown(page) == pytest.approx(1.6)
    expect(page.get_by_label("Joint")).to_have_value("jRightWrist")


def test_a_click_in_a_plot_sets_the_time_and_the_playhead(page: Page) -> None:
    plot = page.locator("ec-chart .plot").nth(1)
    box = plot.bounding_box()
    assert box is not None
    plot.click(position={"x": 48 + (box["width"] - 48 - 8) / 2, "y": box["height"] / 2})
    assert time_shown(page) == pytest.approx(scene.DURATION_S / 2, abs=0.02)
    heads = page.locator("ec-chart .head")
    lefts = {round(heads.nth(i).bounding_box()["x"]) for i in range(heads.count())}  # type: ignore[index]
    assert len(lefts) == 1, "the playheads of all plots stand in one line"


def test_the_keyboard_does_it_all(page: Page) -> None:
    page.locator("body").press("Home")
    page.locator("body").press("ArrowRight")
    page.locator("body").press("ArrowRight")
    assert time_shown(page) == pytest.approx(0.1)
    page.locator("body").press("ArrowLeft")
    assert time_shown(page) == pytest.approx(0.05)
    page.locator("body").press("End")
    assert time_shown(page) == scene.DURATION_S
    page.locator("body").press("Home")
    page.locator("body").press("Space")
    expect(page.get_by_role("button", name="Pause")).to_be_visible()
    page.locator("body").press("k")
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    page.get_by_role("listbox", name="Candidates, best first").press("ArrowDown")
    expect(page.locator("[data-candidate=close-in]")).to_have_attribute("aria-selected", "true")
    page.get_by_role("listbox", name="Candidates, best first").press("End")
    expect(page.get_by_role("alert")).to_contain_text("Out of reach")


def test_tab_reaches_every_control(page: Page) -> None:
    reached = set()
    deepest = """() => {
      let element = document.activeElement;
      while (element?.shadowRoot?.activeElement) element = element.shadowRoot.activeElement;
      return element?.getAttribute("aria-label") || element?.textContent?.trim() || "";
    }"""
    for _ in range(24):
        page.keyboard.press("Tab")
        reached.add(re.sub(r"\s+", " ", page.evaluate(deepest))[:40])
    wanted = {"Open request…", "Candidates, best first", "Play", "Time", "Score", "Joint"}
    assert wanted <= reached


def test_the_spread_is_shown_on_demand(page: Page) -> None:
    assert figure(page).evaluate("body => body.ghostCount") == 0
    page.get_by_label("Spread").check()
    page.wait_for_function(
        "() => document.querySelector('ec-app').renderRoot.querySelector('ec-assessment-page')"
        f".player.figure.ghostCount === {scene.SAMPLES}"
    )
    page.get_by_label("Spread").uncheck()
    page.wait_for_function(
        "() => document.querySelector('ec-app').renderRoot.querySelector('ec-assessment-page')"
        ".player.figure.ghostCount === 0"
    )


def test_assumptions_doubts_and_other_methods_are_on_the_page(page: Page) -> None:
    choose(page, "overhead-far")
    expect(page.get_by_role("note")).to_contain_text("Unlike the demonstrations")
    expect(page.get_by_role("note")).to_contain_text("1.00 s")
    assumed = page.locator("ec-assumed")
    expect(assumed).to_contain_text("Wrist twist")
    expect(assumed).to_contain_text("mid range, end of range")
    expect(assumed).to_contain_text("RULA up to 1 higher")
    cost = page.locator("ec-cost").get_by_role("row", name="RULA mean")
    expect(cost).to_have_text(re.compile(r"5\.80\s+10 %\s+0\.48"))
    others = page.locator("ec-baselines")
    expect(others).to_contain_text("MI-NsGP")
    expect(others).to_contain_text("Cov-IK")
    expect(others.get_by_role("row", name="Minimum norm")).to_contain_text("close-in differs")
    held_out = page.locator("ec-held-out").get_by_role("row", name="MI-NsGP")
    expect(held_out).to_have_text(re.compile(r"1\.6°\s+89 %"))


def test_reba_takes_the_place_of_rula(page: Page) -> None:
    chart = page.locator("ec-chart").first
    assert chart.evaluate("chart => chart.limits[1]") == 7.5
    page.get_by_label("Score").select_option("reba")
    page.wait_for_function(
        "() => document.querySelector('ec-app').renderRoot.querySelector('ec-assessment-page')"
        ".renderRoot.querySelector('ec-candidate-plots').renderRoot.querySelector('ec-chart')"
        ".limits[1] === 15.5"
    )


def test_a_bad_request_shows_its_place_and_what_was_expected(page: Page) -> None:
    page.get_by_role("button", name="Open request").click()
    text = page.get_by_label("Request as JSON")
    text.fill("{nonsense")
    page.get_by_role("button", name="Assess", exact=True).click()
    expect(page.get_by_role("alert")).to_contain_text("This is not JSON")
    text.fill('{"model_id": "unknown"}')
    page.get_by_role("button", name="Assess", exact=True).click()
    expect(page.get_by_role("alert")).to_contain_text("/candidates/0/time_s/2")
    expect(page.get_by_role("alert")).to_contain_text("Expected more than 0.2, got 0.10")
    text.fill('{"model_id": "m-demo"}')
    page.get_by_role("button", name="Assess", exact=True).click()
    expect(page.get_by_role("dialog")).to_have_count(0)


def test_an_unknown_assessment_says_so(watched: Watched, mock_address: str) -> None:
    watched.page.goto(f"{mock_address}#/assessments/gone")
    expect(watched.page.get_by_role("alert")).to_contain_text("Nothing at /v1/assessments/gone")


def test_a_service_that_asks_for_a_key_gets_it(watched: Watched, mock_address: str) -> None:
    def guard(route: Route) -> None:
        if route.request.headers.get("authorization") == "Bearer open sesame":
            route.continue_()
        else:
            refusal = {"type": "/problems/unauthorized", "title": "A key is needed", "status": 401}
            route.fulfill(status=401, json=refusal)

    watched.page.route("**/v1/**", guard)
    watched.page.goto(mock_address)
    watched.page.get_by_label("Key").fill("open sesame")
    watched.page.get_by_role("button", name="Continue").click()
    drawn(watched.page)


def test_names_from_outside_are_text(watched: Watched, mock_address: str) -> None:
    hostile = "<img src=x onerror=document.title='owned'>"
    made = scene.assessment()
    made["candidates"][1]["id"] = hostile
    watched.page.route("**/v1/assessments/a-demo", lambda route: route.fulfill(json=made))
    watched.page.route("**/posture", lambda route: route.fulfill(json=scene.posture("chest-high")))
    watched.page.goto(mock_address)
    expect(watched.page.get_by_role("heading", level=1)).to_contain_text(hostile)
    assert watched.page.title() == "Ergocast"


def test_a_hundred_candidates_stay_usable(watched: Watched, mock_address: str) -> None:
    made = scene.assessment()
    first = made["candidates"][1]
    made["candidates"] = [
        {**first, "id": f"path-{i:03d}", "rank": i + 1, "p_best": 0.01} for i in range(100)
    ]
    watched.page.route("**/v1/assessments/a-demo", lambda route: route.fulfill(json=made))
    watched.page.route("**/posture", lambda route: route.fulfill(json=scene.posture("chest-high")))
    watched.page.goto(mock_address)
    drawn(watched.page)
    watched.page.get_by_role("listbox", name="Candidates, best first").press("End")
    expect(watched.page.locator("[data-candidate=path-099]")).to_be_in_viewport()


def test_the_dark_scheme_is_dark_in_the_picture_too(browser: Browser, mock_address: str) -> None:
    sky = {}
    for scheme in ("light", "dark"):
        context = browser.new_context(color_scheme=scheme)  # type: ignore[arg-type]
        page = context.new_page()
        page.goto(mock_address)
        drawn(page)
        ground = page.evaluate("getComputedStyle(document.documentElement).backgroundColor")
        sky[scheme] = [
            *map(int, re.findall(r"\d+", ground)),
            *figure(page).evaluate("body => body.pixelOf(3, 3)"),
        ]
        context.close()
    assert min(sky["light"]) > 200
    assert max(sky["dark"]) < 80


def test_nothing_is_asked_of_another_host(watched: Watched, mock_address: str) -> None:
    watched.page.goto(mock_address)
    drawn(watched.page)
    assert watched.requests
    assert [url for url in watched.requests if not url.startswith(mock_address)] == []


@pytest.mark.parametrize(("width", "height"), [(390, 844), (820, 1180), (1280, 800), (1920, 1080)])
def test_nothing_is_cut_off_sideways(
    browser: Browser, mock_address: str, width: int, height: int
) -> None:
    context = browser.new_context(viewport={"width": width, "height": height})
    page = context.new_page()
    page.goto(mock_address)
    drawn(page)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    for part in ("ec-candidates", "ec-player", "ec-candidate-plots", "ec-assumed"):
        box = page.locator(part).bounding_box()
        assert box is not None and box["width"] > 250 and box["height"] > 60, part
    context.close()
