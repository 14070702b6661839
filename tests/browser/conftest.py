"""A real Chromium on the built page."""

import shutil
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, ConsoleMessage, Page, Request, sync_playwright

from tests.browser.mock_service import STATIC, served

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_FLAGS = (
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Chromium with its WebGL in software, so that a machine without a screen draws the same."""
    assert (STATIC / "index.html").is_file(), "build the page first: npm run build in web/"
    found = next(filter(None, map(shutil.which, _NAMES)), None)
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=found, args=list(_FLAGS))
        yield chromium
        chromium.close()


@pytest.fixture(scope="session")
def mock_address() -> Iterator[str]:
    """The page over the made-up scene."""
    with served() as address:
        yield address


class Watched:
    """A page whose every complaint and every request is kept."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.complaints: list[str] = []
        self.requests: list[str] = []
        page.on("console", self._heard)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", self._asked)

    def _heard(self, message: ConsoleMessage) -> None:
        # The browser reports a refused request; that the page shows it is what tests check.
        if message.type in ("error", "warning") and "status of 4" not in message.text:
            self.complaints.append(f"{message.type}: {message.text}")

    def _asked(self, request: Request) -> None:
        self.requests.append(request.url)


@pytest.fixture
def watched(browser: Browser) -> Iterator[Watched]:
    """A fresh page of an ordinary laptop; the test fails if anything complained."""
    context = browser.new_context(viewport={"width": 1280, "height": 800})
    context.set_default_timeout(15_000)
    page = Watched(context.new_page())
    yield page
    context.close()
    assert page.complaints == []


@pytest.fixture
def page(watched: Watched, mock_address: str) -> Page:
    """The page of the made-up assessment, loaded and drawn."""
    watched.page.goto(mock_address)
    drawn(watched.page)
    return watched.page


def drawn(page: Page) -> None:
    """Waits until the body stands in the picture."""
    page.wait_for_function(
        """() => {
          const app = document.querySelector("ec-app");
          const pages = "ec-assessment-page, ec-score-page, ec-estimate-page";
          const view = app?.renderRoot?.querySelector(pages);
          const figure = view?.renderRoot.querySelector("ec-player")?.figure;
          return figure && figure.angleOf("jL5S1_roty") !== null && figure.drawn > 1;
        }"""
    )
