"""The Chromium that the browser tests drive."""

from __future__ import annotations

import os
import shutil
import subprocess

from devtools.checkout import Checkout
from devtools.commands import Stop, ask

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
#: Prints where Playwright keeps, or would keep, its own download.
OWN = """
from playwright.sync_api import sync_playwright
with sync_playwright() as playwright:
    print(playwright.chromium.executable_path)
"""


def browser(checkout: Checkout) -> str | None:
    """Returns a Chromium that starts: one on the path, else Playwright's own."""
    for name in NAMES:
        path = shutil.which(name, path=checkout.env.get("PATH"))
        if path and ask([path, "--version"]):
            return path
    own = ask([checkout.python, "-c", OWN], env=checkout.env)
    return own if own and ask([own, "--version"]) else None


def find_browser(checkout: Checkout) -> None:
    """Finds Chromium or gets it: Playwright's download first, then Debian's package.

    Raises:
        Stop: There is none, and none could be had.
    """
    if browser(checkout):
        return
    ways = [[[str(checkout.python), "-m", "playwright", "install", "chromium"]]]
    apt = shutil.which("apt-get", path=checkout.env.get("PATH"))
    if apt and os.geteuid() == 0:
        install = [apt, "install", "--yes", "--no-install-recommends", "chromium"]
        ways.append([[apt, "update"], install])
    env = {"DEBIAN_FRONTEND": "noninteractive", **checkout.env}
    for commands in ways:
        if all(subprocess.run(argv, env=env).returncode == 0 for argv in commands):
            if browser(checkout):
                return
    raise Stop(
        "The browser tests need Chromium, and it could not be downloaded.",
        "sudo apt-get install chromium" if apt else "install Chromium where PATH finds it",
    )
