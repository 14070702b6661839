"""Bodies past the limit are refused, whether or not they say how long they are."""

from collections.abc import Iterator

import pytest
from fastapi import FastAPI, Request
from starlette.testclient import TestClient

from app import problem_handlers
from app.body_limit import BodyLimit


@pytest.fixture
def client() -> TestClient:
    app = FastAPI()
    problem_handlers.install(app)
    app.add_middleware(BodyLimit, json_bytes=100, upload_bytes=1000)

    @app.post("/json")
    def take(body: dict[str, str]) -> int:
        return len(body["a"])

    @app.post("/raw")
    async def raw(request: Request) -> int:
        return sum([len(chunk) async for chunk in request.stream()])

    return TestClient(app)


def pieces(size: int) -> Iterator[bytes]:
    for _ in range(size // 10):
        yield b"x" * 10


@pytest.mark.parametrize(("size", "status"), [(80, 200), (120, 413)])
def test_json_has_its_own_limit(client: TestClient, size: int, status: int) -> None:
    assert client.post("/json", json={"a": "x" * (size - 8)}).status_code == status


@pytest.mark.parametrize("kind", ["application/json", "application/octet-stream"])
def test_a_stream_that_does_not_say_its_length_is_stopped(client: TestClient, kind: str) -> None:
    limit = 100 if "json" in kind else 1000
    headers = {"Content-Type": kind}
    assert client.post("/raw", content=pieces(limit), headers=headers).json() == limit
    answer = client.post("/raw", content=pieces(limit + 10), headers=headers)
    assert answer.status_code == 413
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["type"] == "/problems/too-large"
