"""Runs the command line inside the test's process."""

import pytest

from app.cli import main

Capture = pytest.CaptureFixture[str]


def run(*arguments: object) -> int:
    """Runs the command line and returns its exit code."""
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    return int(ended.value.code or 0)


def failed(capsys: Capture, *arguments: object) -> str:
    """Runs a command that must fail over its input; returns what it said."""
    assert run(*arguments) == 2
    captured = capsys.readouterr()
    assert "Traceback" not in captured.err
    assert captured.out == ""
    return captured.err
