"""Following an operation: the stream ends with the event that ended the work."""

import threading
import time
from collections.abc import Iterator
from typing import Any, cast

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient

from app.operations.repository import OperationFiles
from app.operations.schemas import FINAL
from app.operations.service import Control
from app.service import ErgocastService


def test_work_that_ends_while_its_events_are_read_is_told_to_the_end(
    api: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    service = cast(ErgocastService, cast(FastAPI, api.app).state.service)
    release = threading.Event()

    def work(request: Any, control: Control) -> str:
        assert release.wait(10)
        return "/v1/results/1"

    service.operations.register("wait", work)
    submitted = service.operations.submit("wait", {})
    read = OperationFiles.events

    def events(
        files: OperationFiles, identifier: str, after: int
    ) -> Iterator[tuple[int, dict[str, Any]]]:
        known = list(read(files, identifier, after))
        yield from known
        # Whatever was read, the work ends right after it.
        release.set()
        for _ in range(500):
            if service.operations.get(identifier).state in FINAL:
                return
            time.sleep(0.01)

    monkeypatch.setattr(OperationFiles, "events", events)
    told = api.get(f"/v1/operations/{submitted.id}/events").text
    assert told.count("event: succeeded") == 1
    assert told.rstrip().rsplit("\n\n", 1)[-1].startswith("id: 3\nevent: succeeded\n")
