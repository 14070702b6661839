"""Long work: its record says what happened, also after the service was stopped in between."""

import threading
import time
from pathlib import Path

import pytest

from app.operations.schemas import FINAL, Operation
from app.operations.service import MAX_ATTEMPTS, Control, Operations
from app.problems import Busy, Conflict, InvalidRequest, NotFound


def wait(operations: Operations, identifier: str) -> Operation:
    """Waits until the work has ended; a hang fails by the assertion."""
    for _ in range(500):
        operation = operations.get(identifier)
        if operation.state in FINAL:
            return operation
        time.sleep(0.01)
    raise AssertionError(f"the work never ended: {operation}")


def test_work_reports_progress_and_its_result(tmp_path: Path) -> None:
    operations = Operations(tmp_path)

    def work(request: dict, control: Control) -> str:
        for step in range(request["steps"]):
            control.progress(step + 1, request["steps"], "steps")
        return "/v1/results/1"

    operations.register("count", work)
    operations.start()
    submitted = operations.submit("count", {"steps": 3})
    ended = wait(operations, submitted.id)
    events = [event for _, event in operations.files.events(submitted.id, 0)]
    operations.close()
    assert submitted.state == "queued"
    assert (ended.state, ended.result_url, ended.attempts) == ("succeeded", "/v1/results/1", 1)
    assert (ended.progress.done, ended.progress.total) == (3, 3)
    states = [event["state"] for event in events]
    assert (states[0], states[-1]) == ("queued", "succeeded")
    assert next(number for number, _ in operations.files.events(submitted.id, 2)) == 3
    # What was asked may be personal: it goes once it is answered.
    assert not list(tmp_path.rglob("request.json"))


def test_a_problem_and_an_unforeseen_error_end_as_failed(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    operations = Operations(tmp_path)

    def refuse(request: object, control: Control) -> str:
        raise InvalidRequest("the hand cannot get there")

    def crash(request: object, control: Control) -> str:
        raise ZeroDivisionError("secret posture 1.2345")

    operations.register("refuse", refuse)
    operations.register("crash", crash)
    refused = wait(operations, operations.submit("refuse", {}).id)
    crashed = wait(operations, operations.submit("crash", {}).id)
    operations.close()
    assert refused.state == crashed.state == "failed"
    assert refused.problem is not None and refused.problem["detail"] == "the hand cannot get there"
    assert crashed.problem is not None and "secret" not in str(crashed.problem)
    # The log leads to the line, and says nothing of what was sent.
    assert "ZeroDivisionError at test_operations_service.py:" in caplog.text
    assert "secret" not in caplog.text


def test_cancel_stops_running_and_waiting_work(tmp_path: Path) -> None:
    operations = Operations(tmp_path, workers=1)
    running = threading.Event()

    def work(request: object, control: Control) -> str:
        running.set()
        for step in range(10_000):
            control.progress(step, None)
            time.sleep(0.001)
        return "/never"

    operations.register("long", work)
    first, second = operations.submit("long", {}), operations.submit("long", {})
    assert running.wait(5)
    assert operations.cancel(second.id).state == "cancelled"
    operations.cancel(first.id)
    assert wait(operations, first.id).state == "cancelled"
    with pytest.raises(Conflict, match="cancelled already"):
        operations.cancel(first.id)
    operations.close()


def test_work_that_was_under_way_is_taken_up_after_a_restart(tmp_path: Path) -> None:
    begun = threading.Event()

    def endless(request: object, control: Control) -> str:
        begun.set()
        while True:
            control.progress(0, None)
            time.sleep(0.001)

    before = Operations(tmp_path)
    before.register("job", endless)
    before.start()
    under_way, waiting = before.submit("job", {"n": 1}), before.submit("job", {"n": 2})
    assert begun.wait(5)
    before.close()

    after = Operations(tmp_path)
    after.register("job", lambda request, control: f"/v1/results/{request['n']}")
    after.start()
    assert wait(after, under_way.id).result_url == "/v1/results/1"
    assert wait(after, waiting.id).result_url == "/v1/results/2"
    after.close()


def test_work_that_brings_the_service_down_twice_is_given_up(tmp_path: Path) -> None:
    operations = Operations(tmp_path)
    crashed = Operation(
        id="op_" + "0" * 32,
        kind="job",
        state="running",
        progress={},
        created="2026-01-01T00:00:00Z",
        attempts=MAX_ATTEMPTS,
    )
    operations.files.save(crashed)
    operations.files.save_request(crashed.id, {})
    operations.register("job", lambda request, control: "/never")
    operations.start()
    ended = operations.get(crashed.id)
    operations.close()
    assert ended.state == "failed"
    assert ended.problem is not None and "not begun again" in ended.problem["detail"]


def test_a_second_service_on_the_same_data_leaves_the_first_ones_work_alone(
    tmp_path: Path,
) -> None:
    first = Operations(tmp_path)
    release = threading.Event()
    calls: list[int] = []

    def work(request: object, control: Control) -> str:
        calls.append(1)
        release.wait(5)
        return "/done"

    first.register("job", work)
    first.start()
    submitted = first.submit("job", {})
    second = Operations(tmp_path)
    second.register("job", work)
    second.start()
    second.close()
    release.set()
    assert wait(first, submitted.id).attempts == 1
    first.close()
    assert calls == [1]


def test_a_full_queue_says_when_to_come_back(tmp_path: Path) -> None:
    operations = Operations(tmp_path, queue_limit=1)
    release = threading.Event()

    def work(request: object, control: Control) -> str:
        release.wait(5)
        return "/done"

    operations.register("job", work)
    operations.submit("job", {})
    with pytest.raises(Busy) as caught:
        operations.submit("job", {})
    release.set()
    operations.close()
    assert caught.value.headers["Retry-After"] == "5"


@pytest.mark.parametrize("name", ["../../etc/passwd", "op_", "op_zz", "", "op_" + "0" * 32])
def test_an_id_that_is_not_ours_is_not_found(tmp_path: Path, name: str) -> None:
    operations = Operations(tmp_path)
    with pytest.raises(NotFound):
        operations.get(name)
    operations.close()
