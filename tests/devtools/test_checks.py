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


def test_programs_are_found_by_what_they_hold(checkout: Checkout) -> None:
    inner = checkout.root / "benchmarks" / "prediction"
    inner.mkdir(parents=True)
    (inner / "__init__.py").touch()
    (inner / "shared.py").write_text("TABLE = 1\n")
    for path in (inner / "speed.py", inner.parent / "scoring.py"):
        path.write_text('if __name__ == "__main__":\n    pass\n')
    found = checks.programs(checkout, "benchmarks")
    assert [check.name for check in found] == ["prediction.speed", "scoring"]
    assert found[0].argv[1:] == ["-m", "benchmarks.prediction.speed"]
