"""The page: built when its sources change, with the Node that fits."""

from collections.abc import Callable
from pathlib import Path

import pytest

from devtools import web
from devtools.checkout import Checkout

Script = Callable[[Path, str], Path]


@pytest.mark.parametrize(
    ("version", "accepted"),
    [
        ("v20.19.0", True),
        ("v20.18.3", False),
        ("v21.7.0", False),
        ("v22.11.0", False),
        ("v22.12.0", True),
        ("v24.1.0", True),
        ("", False),
        (None, False),
    ],
)
def test_node_is_accepted_as_vite_does(version: str | None, accepted: bool) -> None:
    assert web.node_accepted(version) is accepted


def page(checkout: Checkout, script: Script) -> None:
    """Gives a working copy web sources and tools that build a page from them."""
    tools = checkout.root / "tools"
    script(tools / "node", "echo v22.12.0")
    script(
        tools / "npm",
        f"PATH=/bin:/usr/bin; echo $1 >> {checkout.root}/npm.log; echo $CA >> {checkout.root}/ca\n"
        "[ $1 = ci ] && mkdir -p node_modules\n"
        '[ "$1" = run ] && mkdir -p ../app/static && cp index.html ../app/static/index.html; true',
    )
    checkout.web.mkdir()
    for name in ("package.json", "package-lock.json", "index.html"):
        (checkout.web / name).write_text(name)


def test_the_page_is_built_when_its_sources_change(checkout: Checkout, script: Script) -> None:
    page(checkout, script)
    log = checkout.root / "npm.log"
    web.build_web(checkout)
    assert log.read_text().split() == ["ci", "run"]
    assert web.is_current(checkout)
    (checkout.web / "node_modules" / "made.js").touch()
    web.build_web(checkout)
    assert log.read_text().split() == ["ci", "run"]
    (checkout.web / "index.html").write_text("changed")
    assert not web.is_current(checkout)
    web.build_web(checkout)
    assert log.read_text().split() == ["ci", "run", "run"]
    assert (checkout.bundle / "index.html").read_text() == "changed"


def test_npm_sees_the_callers_environment(checkout: Checkout, script: Script) -> None:
    checkout.env["CA"] = "my-certificates"
    page(checkout, script)
    web.build_web(checkout)
    assert set((checkout.root / "ca").read_text().split()) == {"my-certificates"}


def test_an_old_node_gives_way_to_the_one_installed(checkout: Checkout, script: Script) -> None:
    page(checkout, script)
    script(checkout.root / "tools" / "node", "echo v18.0.0")
    script(checkout.bin / "node", "echo v24.0.0")
    script(checkout.bin / "npm", "exit 0")
    assert not web.node_is_there(checkout)
    assert web.npm_command(checkout, "ci")[0] == str(checkout.bin / "npm")


def test_a_renamed_source_changes_the_digest(checkout: Checkout, script: Script) -> None:
    page(checkout, script)
    before = web.sources_digest(checkout)
    (checkout.web / "index.html").rename(checkout.web / "main.html")
    assert web.sources_digest(checkout) != before
