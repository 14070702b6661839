"""The commands: what they refuse, and how they end."""

import socket
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path

import pytest

import dev
from devtools.checkout import Checkout
from devtools.commands import Stop


@pytest.mark.parametrize(
    ("python", "system", "remedy"),
    [((3, 10), "linux", "python3.11"), ((3, 12), "win32", "WSL2")],
)
def test_an_unfit_machine_is_told_what_to_do(
    python: tuple[int, int], system: str, remedy: str
) -> None:
    with pytest.raises(Stop) as stop:
        dev.check_machine(python, system)
    assert remedy in stop.value.remedy
    dev.check_machine((3, 11), "darwin")


def test_a_taken_port_is_said_with_a_free_one() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(Stop, match="taken") as stop:
            dev.check_port("127.0.0.1", port)
    assert stop.value.remedy == f"python3 dev.py run --port {port + 1}"
    dev.check_port("127.0.0.1", port)


@pytest.mark.parametrize("port", ["0", "99999", "-1"])
def test_an_impossible_port_is_refused(port: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        dev.main(["run", f"--port={port}"])
    assert "between 1 and 65535" in capsys.readouterr().err


def test_a_foreign_address_is_said() -> None:
    with pytest.raises(Stop, match="Cannot listen"):
        dev.check_port("192.0.2.1", 8000)


def test_a_stop_is_one_problem_and_one_remedy(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(dev, "check_machine", stopping(Stop("It is so.", "do this")))
    assert dev.main(["setup"]) == 1
    assert capsys.readouterr().err == "\ndev.py: It is so.\n  Do this: do this\n"
    monkeypatch.setattr(dev, "check_machine", stopping(KeyboardInterrupt()))
    assert dev.main(["setup"]) == 130
    assert "stopped" in capsys.readouterr().err


def test_bench_runs_all_of_them_once(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("prediction.__main__", "prediction.speed", "scoring"):
        path = (tmp_path / "benchmarks" / name.replace(".", "/")).with_suffix(".py")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"# python -m benchmarks.{name.removesuffix('.__main__')}\n")
    ran: list[str] = []
    monkeypatch.setattr(dev, "set_up", lambda *_, **__: None)
    monkeypatch.setattr(dev, "run_checks", lambda _, found: ran.extend(one.name for one in found))
    checkout = Checkout(tmp_path, {})
    dev.bench(checkout, Namespace(names=[]))
    assert ran == ["prediction", "scoring"]
    ran.clear()
    dev.bench(checkout, Namespace(names=["prediction.speed"]))
    assert ran == ["prediction.speed"]


def stopping(error: BaseException) -> Callable[..., None]:
    def stop(*argv: object) -> None:
        raise error

    return stop
