"""Checks: all of them run, the failed ones are named, recordings nearby are used."""

from pathlib import Path

import pytest

from devtools import checks
from devtools.checkout import Checkout
from devtools.commands import Stop


def test_every_check_runs_and_the_failed_ones_are_named(checkout: Checkout) -> None:
    trace = checkout.root / "trace"
    made = [
        checks.Check(name, ["/bin/sh", "-c", f"echo {name} >> {trace}; exit {code}"], checkout.root)
        for name, code in (("one", 1), ("two", 0), ("three", 2))
    ]
    with pytest.raises(Stop, match=r"Failed: one, three\."):
        checks.run_checks(checkout, made)
    assert trace.read_text().split() == ["one", "two", "three"]
    checks.run_checks(checkout, made[1:2])


def test_recordings_beside_the_checkout_are_used(checkout: Checkout, tmp_path: Path) -> None:
    inner = Checkout(tmp_path / "copy", checkout.env)
    assert "ERGOCAST_RECORDINGS" not in checks.check_env(inner)
    (tmp_path / "shared" / "data").mkdir(parents=True)
    assert checks.check_env(inner)["ERGOCAST_RECORDINGS"] == str(tmp_path / "shared" / "data")
    inner.env["ERGOCAST_RECORDINGS"] = "elsewhere"
    assert checks.check_env(inner)["ERGOCAST_RECORDINGS"] == "elsewhere"


def test_programs_are_found_by_how_they_say_they_are_run(checkout: Checkout) -> None:
    top = checkout.root / "benchmarks"
    inner = top / "prediction"
    inner.mkdir(parents=True)
    (inner / "__init__.py").touch()
    (inner / "shared.py").write_text("TABLE = 1\n")
    (inner / "by_path.py").write_text(
        '"""python by_path.py"""\nif __name__ == "__main__":\n    1\n'
    )
    for name, path in (
        ("prediction", inner / "__main__.py"),
        ("prediction.speed", inner / "speed.py"),
        ("scoring", top / "scoring.py"),
    ):
        path.write_text(f'"""Run ``python -m benchmarks.{name}``."""\n')
    found = checks.programs(checkout, "benchmarks")
    assert [check.name for check in found] == ["prediction", "prediction.speed", "scoring"]
    assert found[1].argv[1:] == ["-m", "benchmarks.prediction.speed"]
