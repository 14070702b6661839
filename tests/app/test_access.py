"""Who gets in: keys where they are set, and no foreign page on a machine that needs none."""

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient

from app.access import Access
from app.problems import ConfigurationError
from app.settings import Settings, check_bind, is_loopback


def client(keys: tuple[str, ...], base: str = "http://127.0.0.1:8000") -> TestClient:
    app = FastAPI()
    app.add_middleware(Access, keys=keys)

    @app.get("/v1/things")
    def things() -> dict[str, str]:
        return {"got": "in"}

    @app.get("/health/live")
    def live() -> dict[str, str]:
        return {"got": "in"}

    return TestClient(app, base_url=base)


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "[::1]", "127.0.0.1:8123"])
def test_without_keys_this_machine_needs_none(host: str) -> None:
    assert client(()).get("/v1/things", headers={"Host": host}).status_code == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example"},
        {"Host": "["},
        {"Origin": "http://["},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:9999"},
    ],
)
def test_without_keys_a_foreign_page_is_refused(headers: dict[str, str]) -> None:
    answer = client(()).get("/v1/things", headers=headers)
    assert answer.status_code == 403
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["type"] == "/problems/forbidden"


def test_the_services_own_page_gets_in() -> None:
    answer = client(()).get("/v1/things", headers={"Origin": "http://127.0.0.1:8000"})
    assert answer.status_code == 200


@pytest.mark.parametrize(
    ("header", "status"),
    [
        (None, 401),
        ("Bearer wrong", 401),
        ("Bearer ", 401),
        ("Basic second", 401),
        ("Bearer second", 200),
        ("bearer first", 200),
    ],
)
def test_with_keys_one_of_them_is_needed(header: str | None, status: int) -> None:
    headers = {} if header is None else {"Authorization": header}
    answer = client(("first", "second"), "http://example.org").get("/v1/things", headers=headers)
    assert answer.status_code == status
    assert ("www-authenticate" in answer.headers) == (status == 401)


def test_health_needs_no_key() -> None:
    assert client(("first",), "http://example.org").get("/health/live").status_code == 200


@pytest.mark.parametrize("host", ["127.0.0.1", "127.1.2.3", "localhost", "::1", "[::1]"])
def test_loopback_addresses_need_no_key(host: str) -> None:
    assert is_loopback(host)
    check_bind(host, Settings(api_keys=""))


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.5", "example.org"])
def test_other_addresses_are_refused_without_a_key(host: str) -> None:
    with pytest.raises(ConfigurationError, match="ERGOCAST_API_KEYS"):
        check_bind(host, Settings(api_keys=" , "))
    check_bind(host, Settings(api_keys="secret"))


def test_keys_do_not_show_in_the_settings_text() -> None:
    assert "secret" not in repr(Settings(api_keys="secret"))
