"""Does long work in threads, and keeps its record through a restart of the service."""

import fcntl
import logging
import secrets
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any

from app.operations.repository import OperationFiles
from app.operations.schemas import FINAL, Operation, Progress
from app.problems import Busy, Cancelled, Conflict, Internal, Problem, place_of

_log = logging.getLogger("ergocast")

#: Work that was begun this often and never ended is given up: it may be what brings us down.
MAX_ATTEMPTS = 2
#: Progress is written at most this often, in seconds.
_PROGRESS_PERIOD_S = 0.2

#: Does the work and returns the address of its result.
Handler = Callable[[Any, "Control"], str]


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


class Control:
    """What the work sees of its operation: report progress, notice a cancel."""

    def __init__(self, operations: "Operations", identifier: str) -> None:
        """Belongs to the operation ``identifier``."""
        self._operations = operations
        self._id = identifier
        self._cancel = threading.Event()
        self._first: tuple[int, float] | None = None
        self._reported = 0.0

    def cancel(self) -> None:
        """Asks the work to stop at its next report."""
        self._cancel.set()

    def is_cancelled(self) -> bool:
        """Returns whether the work is to stop, for work that asks more often than it reports."""
        return self._cancel.is_set()

    def is_cancelled_by_client(self) -> bool:
        """Returns whether a client asked for that, not the end of the service."""
        return self._operations.get(self._id).cancel_requested

    def progress(
        self,
        done: int,
        total: int | None,
        unit: str = "",
        message: str = "",
        log_likelihood: float | None = None,
    ) -> None:
        """Reports how far the work is.

        Raises:
            Cancelled: Someone asked to stop.
        """
        if self._cancel.is_set():
            raise Cancelled("The work was stopped because a client cancelled it.")
        now = time.monotonic()
        if now - self._reported < _PROGRESS_PERIOD_S and done != total:
            return
        self._reported = now
        if self._first is None:
            # Work that goes on after a restart begins in the middle.
            self._first = (done, now)
        gone, took = done - self._first[0], now - self._first[1]
        rate = gone / took if gone > 0 and took > 0 else None
        eta = (total - done) / rate if rate and total is not None else None
        self._operations._report(
            self._id,
            Progress(
                done=done,
                total=total,
                unit=unit,
                rate=rate,
                eta_s=eta,
                message=message,
                log_likelihood=log_likelihood,
            ),
        )


class Operations:
    """Queue, records and threads of long work.

    The record on disk is the intent: it is written before the work is queued, so that work which
    was waiting or under way when the service stopped is taken up at the next start.
    """

    def __init__(self, folder: Path, workers: int = 1, queue_limit: int = 64) -> None:
        """Keeps records under ``folder`` and works in ``workers`` threads."""
        self._folder = folder
        self._files = OperationFiles(folder)
        self._queue_limit = queue_limit
        self._handlers: dict[str, Handler] = {}
        self._controls: dict[str, Control] = {}
        self._lock = threading.RLock()
        self._pool = ThreadPoolExecutor(workers, thread_name_prefix="operation")
        self._owner: IO[bytes] | None = None
        self._closing = False

    @property
    def files(self) -> OperationFiles:
        """The records."""
        return self._files

    def is_working(self) -> bool:
        """Returns whether the service takes work."""
        return not self._closing

    def register(self, kind: str, handler: Handler) -> None:
        """Names the function that does work of ``kind``."""
        self._handlers[kind] = handler

    def start(self) -> None:
        """Takes up work that a previous run left unfinished.

        Only one process per folder does so: a second service on the same data must not repeat
        what the first is doing.
        """
        self._folder.mkdir(parents=True, exist_ok=True)
        owner = (self._folder / ".owner").open("wb")
        try:
            fcntl.flock(owner, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            owner.close()
            return
        self._owner = owner
        for operation in self._files.all():
            if operation.state not in FINAL:
                self._take_up(operation)

    def _take_up(self, operation: Operation) -> None:
        if operation.cancel_requested:
            self._finish(operation, "cancelled", problem=Cancelled("Cancelled by a client."))
        elif operation.attempts >= MAX_ATTEMPTS:
            self._finish(
                operation,
                "failed",
                problem=Internal(
                    f"The service stopped {operation.attempts} times during this work; "
                    "it was not begun again."
                ),
            )
        elif operation.kind not in self._handlers:
            self._finish(operation, "failed", problem=Internal("This version cannot do such work."))
        else:
            operation.state = "queued"
            operation.progress = Progress(message="Queued again after a restart.")
            self._store(operation)
            self._enqueue(operation.id)

    def submit(self, kind: str, request: Any) -> Operation:
        """Records work and queues it.

        Raises:
            Busy: Too much work waits already.
        """
        with self._lock:
            if len(self._controls) >= self._queue_limit:
                raise Busy(
                    f"{len(self._controls)} operations are waiting or running.",
                    headers={"Retry-After": "5"},
                )
            operation = Operation(
                id=f"op_{time.time_ns():016x}{secrets.token_hex(8)}",
                kind=kind,
                state="queued",
                progress=Progress(),
                created=_now(),
            )
            self._files.save_request(operation.id, request)
            self._store(operation)
            self._enqueue(operation.id)
        return operation

    def get(self, identifier: str) -> Operation:
        """Returns an operation as it is now."""
        with self._lock:
            return self._files.load(identifier)

    def cancel(self, identifier: str) -> Operation:
        """Asks work to stop; it does at its next report of progress.

        Raises:
            NotFound: There is no such operation.
            Conflict: It has ended already.
        """
        with self._lock:
            operation = self._files.load(identifier)
            if operation.state in FINAL:
                raise Conflict(f"Operation {identifier} has {operation.state} already.")
            operation.cancel_requested = True
            if operation.state == "queued":
                self._finish(operation, "cancelled", problem=Cancelled("Cancelled by a client."))
            else:
                self._store(operation)
            control = self._controls.get(identifier)
            if control is not None:
                control.cancel()
            return operation

    def close(self) -> None:
        """Stops taking work; what is under way stays on record for the next start."""
        self._closing = True
        with self._lock:
            for control in self._controls.values():
                control.cancel()
        self._pool.shutdown(wait=True, cancel_futures=True)
        if self._owner is not None:
            self._owner.close()
            self._owner = None

    def _enqueue(self, identifier: str) -> None:
        self._controls[identifier] = Control(self, identifier)
        self._pool.submit(self._work, identifier)

    def _work(self, identifier: str) -> None:
        with self._lock:
            operation = self._files.load(identifier)
            control = self._controls[identifier]
            if operation.state in FINAL:
                self._controls.pop(identifier, None)
                return
            operation.state = "running"
            operation.started = _now()
            operation.attempts += 1
            self._store(operation)
        problem: Problem | None = None
        result: str | None = None
        try:
            result = self._handlers[operation.kind](self._files.load_request(identifier), control)
        except Problem as error:
            problem = error
        except Exception as error:
            _log.error("operation %s (%s): %s", identifier, operation.kind, place_of(error))
            problem = Internal("The work failed in a way the service did not foresee.")
        with self._lock:
            self._controls.pop(identifier, None)
            operation = self._files.load(identifier)
            if isinstance(problem, Cancelled):
                if self._closing and not operation.cancel_requested:
                    # Stopped by our own end, not by a client: begin again at the next start.
                    operation.state = "queued"
                    operation.attempts -= 1
                    self._store(operation)
                else:
                    self._finish(operation, "cancelled", problem=problem)
            elif problem is not None:
                self._finish(operation, "failed", problem=problem)
            else:
                operation.result_url = result
                self._finish(operation, "succeeded")

    def _finish(self, operation: Operation, state: Any, problem: Problem | None = None) -> None:
        operation.state = state
        operation.finished = _now()
        if problem is not None:
            operation.problem = problem.body(f"/v1/operations/{operation.id}")
        self._store(operation)
        self._files.forget_request(operation.id)

    def _report(self, identifier: str, progress: Progress) -> None:
        with self._lock:
            operation = self._files.load(identifier)
            operation.progress = progress
            self._store(operation)

    def _store(self, operation: Operation) -> None:
        self._files.save(operation)
        self._files.append_event(operation)
