"""Makes the pictures of the dashboard: the demonstration, and a simulated lift on force plates.

Run from the checkout's root with the built page: ``python -m docs.screenshot``. It makes the
demonstration in a folder that it removes again (``--data DIR`` uses one that is there), serves it
on a free port and writes ``docs/images/dashboard.png``, the same at the size of a phone, and
``estimate.png``.
"""

import argparse
import shutil
import socket
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import uvicorn
from playwright.sync_api import Page, sync_playwright

from app.client import Client
from app.demo import load_demo
from app.main import create_app
from app.settings import Settings
from tests.app.estimates.lifting import EMPTY_S, PERSON, write_lifting

IMAGES = Path(__file__).parent / "images"
FLAGS = (
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
)
DRAWN = """() => document.querySelector("ec-app")?.renderRoot
    ?.querySelector("ec-assessment-page, ec-estimate-page")?.renderRoot
    .querySelector("ec-player")?.figure?.drawn > 2"""


@contextmanager
def served(data: Path) -> Iterator[str]:
    """Serves a data folder on a free port; gives the address."""
    app = create_app(Settings(data=data, api_keys=""))
    load_demo(app.state.service)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        server = uvicorn.Server(uvicorn.Config(app, log_level="error", ws="none"))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
        thread.start()
        while thread.is_alive() and not server.started:
            time.sleep(0.05)
        yield f"http://127.0.0.1:{listener.getsockname()[1]}/"
        server.should_exit = True
        thread.join()


def photograph(page: Page, address: str, file: Path) -> None:
    """Takes the picture of the last-ranked candidate at its worst moment, with the spread."""
    page.goto(address)
    page.wait_for_function(DRAWN)
    ranked = page.locator("[data-candidate]:not(.problem)")
    ranked.last.click()
    page.get_by_label("Spread").check()
    page.get_by_role("region", name="Worst moments").get_by_role("button").first.click()
    page.wait_for_timeout(800)
    file.parent.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=file)


def estimate(address: str, folder: Path) -> str:
    """Estimates a simulated lift of a box; returns the estimate's id."""
    files = write_lifting(folder)
    with Client(address) as client:
        recording = client.add_recording(files.motion)
        client.add_file(recording["id"], "static", files.static)
        client.add_file(recording["id"], "grf", files.grf)
        found = client.estimate(
            recording["id"], height_m=PERSON.height_m, mass_kg=PERSON.mass_kg, tare_s=list(EMPTY_S)
        )
        return str(found["id"])


def photograph_estimate(page: Page, address: str, file: Path) -> None:
    """Takes the picture of an estimate as it opens."""
    page.goto(address)
    page.wait_for_function(DRAWN)
    page.wait_for_timeout(800)
    page.screenshot(path=file)


def main() -> None:
    """Takes all pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, help="a data folder to use, and to leave")
    options = parser.parse_args()
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=list(FLAGS))
        with served(options.data or Path(folder)) as address:
            for name, width, height in (("dashboard", 1280, 800), ("phone", 390, 844)):
                page = browser.new_page(viewport={"width": width, "height": height})
                photograph(page, address, IMAGES / f"{name}.png")
                page.close()
            found = estimate(address, Path(folder))
            page = browser.new_page(viewport={"width": 1280, "height": 1010})
            photograph_estimate(page, f"{address}#/estimates/{found}", IMAGES / "estimate.png")
        browser.close()


if __name__ == "__main__":
    main()
