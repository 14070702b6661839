"""Chromium: found, or got, or asked for."""

from collections.abc import Callable
from pathlib import Path

import pytest

from devtools import browser
from devtools.checkout import Checkout
from devtools.commands import Stop

Script = Callable[[Path, str], Path]


def test_a_browser_on_the_path_is_enough(checkout: Checkout, script: Script) -> None:
    found = script(checkout.root / "tools" / "chromium", "echo Chromium 156")
    assert browser.browser(checkout) == str(found)


@pytest.mark.parametrize(("apt", "remedy"), [(True, "sudo apt-get"), (False, "install Chromium")])
def test_a_browser_that_does_not_start_does_not_count(
    checkout: Checkout, script: Script, monkeypatch: pytest.MonkeyPatch, apt: bool, remedy: str
) -> None:
    if apt:
        script(checkout.root / "tools" / "apt-get", "exit 0")
    script(checkout.root / "tools" / "chromium", "exit 127")
    script(checkout.python, "exit 1")
    monkeypatch.setattr(browser.os, "geteuid", lambda: 1000)
    with pytest.raises(Stop) as stop:
        browser.find_browser(checkout)
    assert stop.value.remedy.startswith(remedy)


def test_root_on_debian_gets_the_browser_by_apt(
    checkout: Checkout, script: Script, monkeypatch: pytest.MonkeyPatch
) -> None:
    tools = checkout.root / "tools"
    script(checkout.python, "exit 1")
    made = f"echo '#!/bin/sh\necho Chromium' > {tools}/chromium; chmod +x {tools}/chromium"
    script(tools / "apt-get", f"PATH=/bin:/usr/bin; [ $1 = update ] || {{ {made}; }}")
    monkeypatch.setattr(browser.os, "geteuid", lambda: 0)
    browser.find_browser(checkout)
    assert browser.browser(checkout) == str(tools / "chromium")
