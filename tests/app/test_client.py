"""The client against a real service in a thread: what the guide shows works as pasted."""

import re
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import uvicorn

from app.client import (
    AccessError,
    ApiError,
    Client,
    ClientError,
    ConnectionFailed,
    FormatError,
    MissingError,
    RequestRejected,
)
from app.main import create_app
from app.settings import Settings
from tests.app.conftest import Scene

ROOT = Path(__file__).parents[2]


def served(settings: Settings) -> Iterator[str]:
    """Serves on a free port of this machine; yields the address."""
    listening = socket.socket()
    listening.bind(("127.0.0.1", 0))
    listening.listen()
    server = uvicorn.Server(uvicorn.Config(create_app(settings), log_level="error"))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
    thread.start()
    try:
        yield f"http://127.0.0.1:{listening.getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join()
        listening.close()


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    yield from served(Settings(data=tmp_path_factory.mktemp("service"), api_keys=""))


def test_the_client_ranks_candidates_at_once_and_in_the_background(url: str, scene: Scene) -> None:
    with Client(url) as client:
        model = client.add_model(scene.file)
        answer = client.assess(scene.request(model["id"]))
        assert [one["rank"] for one in answer["candidates"]]
        assert client.assessment(answer["id"]) == answer
        assert client.assessments()[0]["id"] == answer["id"]
        assert client.posture(answer["id"], "direct")["time_s"][0] == 0.0
        moves: list[str] = []
        many = scene.candidates()[0]
        # More points than are answered at once.
        fine = np.linspace(many["time_s"][0], many["time_s"][-1], 20_000)
        columns = {
            name: np.stack(
                [np.interp(fine, many["time_s"], np.array(many[name])[:, k]) for k in range(size)],
                axis=1,
            )
            for name, size in (("position_m", 3), ("orientation_xyzw", 4))
        }
        q = columns["orientation_xyzw"]
        columns["orientation_xyzw"] = q / np.linalg.norm(q, axis=1, keepdims=True)
        candidates = [
            {"id": "a", "time_s": fine.tolist(), **{k: v.tolist() for k, v in columns.items()}},
            scene.candidates()[1],
        ]
        request = scene.request(model["id"], candidates=candidates, samples=2)
        later = client.assess(request, progress=lambda operation: moves.append(operation["state"]))
        assert moves[-1] == "succeeded"
        assert [one["problem"] for one in later["candidates"]] == [None, None]


def test_the_client_trains_and_waits_for_the_model(tmp_path: Path) -> None:
    # a service of its own: the newest model of the shared one is the scene's
    for url in served(Settings(data=tmp_path, api_keys="")):
        _trains_and_waits(url)


def _trains_and_waits(url: str) -> None:
    with Client(url) as client:
        moves: list[str] = []
        model = client.train(
            [], lambda now: moves.append(now["state"]), height_m=1.66, mass_kg=59.5, hand="left"
        )
        assert moves[-1] == "succeeded"
        assert (model["subject"]["height_m"], model["hand"]) == (1.66, "left")
        assert model["id"] in [one["id"] for one in client.models()]
        with pytest.raises(RequestRejected, match="/height_m"):
            client.train([], height_m="tall", mass_kg=59.5)
        with pytest.raises(MissingError):
            client.train(["rec_" + "0" * 64], height_m=1.66, mass_kg=59.5)


def test_the_client_scores_recordings_and_worksheets(url: str, bvh: Path) -> None:
    with Client(url) as client:
        recording = client.add_recording(bvh)
        assert client.recordings()[0]["id"] == recording["id"]
        score = client.score(recording["id"], height_m=1.72, mass_kg=68)
        assert score["summary"]["rula"]["max"] >= 3
        with pytest.raises(RequestRejected) as caught:
            client.worksheet("rula", {"input": {"tail": {}}})
        assert caught.value.faults[0]["pointer"].startswith("/input")


def test_problems_become_errors_of_their_kind(url: str, bvh: Path, tmp_path: Path) -> None:
    with Client(url) as client:
        with pytest.raises(MissingError):
            client.assessment("asm_" + "0" * 64)
        with pytest.raises(FormatError):
            client.add_model(bvh)
        with pytest.raises(RequestRejected, match="/candidates"):
            client.assess({"model_id": "x", "candidates": []})
        junk = tmp_path / "junk.bvh"
        junk.write_bytes(b"junk")
        with pytest.raises(ApiError) as caught:
            client.add_recording(junk)
    assert caught.value.problem["status"] == caught.value.status


def test_nobody_at_the_address_is_said() -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"http://127.0.0.1:{free.getsockname()[1]}"
    with Client(address) as client, pytest.raises(ConnectionFailed, match="ergocast serve"):
        client.models()


def test_a_key_is_sent_where_one_is_given(tmp_path: Path) -> None:
    for address in served(Settings(data=tmp_path, api_keys="secret")):
        with Client(address) as client, pytest.raises(AccessError):
            client.models()
        with Client(address, api_key="secret") as client:
            assert client.models() == []


@pytest.mark.parametrize("document", ["README.md", "docs/api.md"])
def test_the_first_call_shown_works_as_pasted(
    url: str, scene: Scene, capsys: pytest.CaptureFixture[str], document: str
) -> None:
    with Client(url) as client:
        client.add_model(scene.file)
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / document).read_text("utf-8"), re.DOTALL)
    code = blocks[0].replace("http://127.0.0.1:8000", url)
    exec(compile(code, document, "exec"), {})
    # Indented lines are warnings to the reader.
    lines = [x for x in capsys.readouterr().out.splitlines() if not x.startswith(" ")]
    assert [line.split()[0] for line in lines] == ["up", "down"]
    assert {line.split()[1] for line in lines} == {"1", "2"}


def test_every_error_derives_from_one() -> None:
    import app.client

    errors = [
        value
        for name in app.client.__all__
        if isinstance(value := getattr(app.client, name), type) and issubclass(value, Exception)
    ]
    assert len(errors) > 8
    assert all(issubclass(error, ClientError) for error in errors)
