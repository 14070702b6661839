"""Client of the REST API: ``from app.client import Client``.

Errors are drawn from the problem types the service answers with::

    ClientError
    ├── ConnectionFailed        nobody answers at the address
    └── ApiError                the service answered with a problem
        ├── RequestRejected  422    ├── MissingError 404
        ├── ConflictError    409    ├── TooLargeError 413
        ├── FormatError      415    └── AccessError 401, 403
"""

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import httpx2

#: Where ``ergocast serve`` listens unless told otherwise.
DEFAULT_URL = "http://127.0.0.1:8000"
_MODEL_TYPE = "application/vnd.ergocast.model"


class ClientError(Exception):
    """Base of every error raised by the client."""


class ConnectionFailed(ClientError):
    """Nobody answers at the address."""


class OperationFailed(ClientError):
    """Long work ended without a result.

    Attributes:
        operation: The operation as it ended.
    """

    def __init__(self, operation: dict[str, Any]) -> None:
        """Stores the operation and says why it ended."""
        problem = operation.get("problem") or {}
        super().__init__(f"{operation['id']} {operation['state']}: {problem.get('detail', '')}")
        self.operation = operation


class ApiError(ClientError):
    """The service answered with a problem.

    Attributes:
        status: HTTP status.
        problem: The ``application/problem+json`` body.
        faults: What is wrong and where (``pointer``, ``expected``, ``got``, ``detail``).
    """

    def __init__(self, status: int, problem: dict[str, Any]) -> None:
        """Stores the problem and says it in words."""
        self.status = status
        self.problem = problem
        self.faults: list[dict[str, str]] = problem.get("errors", [])
        lines = [f"{status}: {problem.get('detail') or problem.get('title') or 'no detail'}"]
        lines += [
            f"  {f['pointer'] or '/'}: {f['detail']} (expected {f['expected']}; got {f['got']})"
            for f in self.faults
        ]
        super().__init__("\n".join(lines))


class RequestRejected(ApiError):
    """The request is malformed; see ``faults``."""


class MissingError(ApiError):
    """There is nothing by that id."""


class ConflictError(ApiError):
    """The state of the thing forbids it."""


class TooLargeError(ApiError):
    """The body is larger than the service takes."""


class FormatError(ApiError):
    """The file is in no format that the service reads."""


class AccessError(ApiError):
    """The key is missing or wrong."""


_ERRORS: Mapping[int, type[ApiError]] = {
    401: AccessError,
    403: AccessError,
    404: MissingError,
    409: ConflictError,
    413: TooLargeError,
    415: FormatError,
    422: RequestRejected,
}


class Client:
    """Talks to one Ergocast service.

    Example:
        >>> with Client() as client:
        ...     model = client.models()[0]
        ...     answer = client.assess({"model_id": model["id"], ...})
    """

    def __init__(
        self,
        url: str = DEFAULT_URL,
        api_key: str | None = None,
        timeout_s: float = 120.0,
        transport: httpx2.BaseTransport | None = None,
    ) -> None:
        """Opens a connection pool; nothing is sent yet.

        Args:
            url: Where the service listens.
            api_key: Sent as a bearer token, if the service asks for one.
            timeout_s: How long one answer may take.
            transport: Replaces the network, in tests.
        """
        headers = {"Authorization": f"Bearer {api_key}"} if api_key else {}
        self._http = httpx2.Client(
            base_url=url, headers=headers, timeout=timeout_s, transport=transport
        )

    def __enter__(self) -> Self:
        """Returns the client."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Closes the connections."""
        self.close()

    def close(self) -> None:
        """Closes the connections."""
        self._http.close()

    def assess(
        self,
        request: Mapping[str, Any],
        progress: Callable[[dict[str, Any]], None] | None = None,
    ) -> dict[str, Any]:
        """Ranks candidates; waits for the answer, also where it is made in the background.

        Args:
            request: The body of ``POST /v1/assessments``.
            progress: Called with the operation each time it has moved, if there is one.

        Raises:
            RequestRejected: The request is malformed.
            OperationFailed: The work ended without a result.
        """
        response = self._send("POST", "/v1/assessments", json=dict(request))
        if response.status_code != 202:
            return dict(response.json())
        operation = self.wait(response.json()["id"], progress)
        return self._get(operation["result_url"])

    def assessment(self, assessment_id: str) -> dict[str, Any]:
        """Returns an earlier assessment."""
        return self._get(f"/v1/assessments/{assessment_id}")

    def assessments(self) -> list[dict[str, Any]]:
        """Lists assessments, newest first."""
        return list(self._get("/v1/assessments")["items"])

    def posture(self, assessment_id: str, candidate_id: str) -> dict[str, Any]:
        """Returns the predicted body along one candidate."""
        return self._get(f"/v1/assessments/{assessment_id}/candidates/{candidate_id}/posture")

    def models(self) -> list[dict[str, Any]]:
        """Lists operator models, newest first."""
        return list(self._get("/v1/models")["items"])

    def add_model(self, path: str | Path) -> dict[str, Any]:
        """Sends a model file made by ``ergocast train``."""
        return self._upload("/v1/models", Path(path), _MODEL_TYPE)

    def train(
        self,
        recordings: Sequence[str],
        progress: Callable[[dict[str, Any]], None] | None = None,
        **options: Any,
    ) -> dict[str, Any]:
        """Trains an operator model on recordings and waits for its record.

        Args:
            recordings: Their ids; with what was added to them.
            progress: Called with the operation each time it has moved.
            options: The other fields of ``POST /v1/models``, such as ``height_m`` or ``add_to``.

        Raises:
            RequestRejected: The request is malformed.
            OperationFailed: The work ended without a result.
        """
        body = {"recordings": list(recordings), **options}
        operation = self._send("POST", "/v1/models", json=body).json()
        return self._get(self.wait(operation["id"], progress)["result_url"])

    def recordings(self) -> list[dict[str, Any]]:
        """Lists recordings, newest first."""
        return list(self._get("/v1/recordings")["items"])

    def add_recording(self, path: str | Path) -> dict[str, Any]:
        """Sends a recording."""
        return self._upload("/v1/recordings", Path(path), "application/octet-stream")

    def add_file(self, recording_id: str, role: str, path: str | Path) -> dict[str, Any]:
        """Adds a file to a recording.

        Args:
            recording_id: The recording of the motion.
            role: ``static``, ``grf``, ``static_grf``, ``marker_set`` or ``columns``.
            path: The file.
        """
        where = f"/v1/recordings/{recording_id}/files"
        return self._upload(where, Path(path), "application/octet-stream", role=role)

    def estimate(
        self,
        recording_id: str,
        progress: Callable[[dict[str, Any]], None] | None = None,
        **options: Any,
    ) -> dict[str, Any]:
        """Estimates a recording and waits for the summary.

        Args:
            recording_id: The recording, with the files that were added to it.
            progress: Called with the operation each time it has moved.
            options: The other fields of ``POST /v1/estimates``, such as ``height_m``.

        Raises:
            RequestRejected: The request is malformed.
            OperationFailed: The work ended without a result.
        """
        body = {"recording_id": recording_id, **options}
        operation = self._send("POST", "/v1/estimates", json=body).json()
        return self._get(self.wait(operation["id"], progress)["result_url"])

    def estimates(self) -> list[dict[str, Any]]:
        """Lists estimates, newest first."""
        return list(self._get("/v1/estimates")["items"])

    def series(
        self,
        estimate_id: str,
        columns: Sequence[str],
        start_s: float | None = None,
        end_s: float | None = None,
    ) -> dict[str, list[Any]]:
        """Returns columns of an estimate over some time; None where a value cannot be told."""
        query = {"columns": ",".join(columns), "start": start_s, "end": end_s}
        given = {key: value for key, value in query.items() if value is not None}
        response = self._send("GET", f"/v1/estimates/{estimate_id}/series", params=given)
        return dict(response.json()["columns"])

    def save_series(self, estimate_id: str, path: str | Path) -> None:
        """Writes an estimate's whole time series to a Parquet file."""
        response = self._send("GET", f"/v1/estimates/{estimate_id}/series.parquet")
        Path(path).write_bytes(response.content)

    def score(self, recording_id: str | None = None, **options: Any) -> dict[str, Any]:
        """Scores a recording; ``options`` are the other fields of ``POST /v1/scores``.

        With ``estimate_id`` instead, its recording is scored with the payload it found.
        """
        body = options if recording_id is None else {"recording_id": recording_id, **options}
        return dict(self._send("POST", "/v1/scores", json=body).json())

    def worksheet(self, method: str, worksheet: Mapping[str, Any]) -> dict[str, Any]:
        """Scores one worksheet; ``method`` is ``rula`` or ``reba``."""
        return dict(self._send("POST", f"/v1/worksheets/{method}", json=dict(worksheet)).json())

    def operation(self, operation_id: str) -> dict[str, Any]:
        """Returns an operation as it is now."""
        return self._get(f"/v1/operations/{operation_id}")

    def cancel(self, operation_id: str) -> dict[str, Any]:
        """Asks long work to stop."""
        return dict(self._send("POST", f"/v1/operations/{operation_id}/cancel").json())

    def wait(
        self,
        operation_id: str,
        progress: Callable[[dict[str, Any]], None] | None = None,
        poll_s: float = 0.2,
    ) -> dict[str, Any]:
        """Waits until long work has ended.

        Raises:
            OperationFailed: It ended without a result.
        """
        while True:
            operation = self.operation(operation_id)
            if progress is not None:
                progress(operation)
            if operation["state"] == "succeeded":
                return operation
            if operation["state"] in ("failed", "cancelled"):
                raise OperationFailed(operation)
            time.sleep(poll_s)

    def _get(self, path: str) -> dict[str, Any]:
        return dict(self._send("GET", path).json())

    def _upload(self, path: str, file: Path, kind: str, **query: str) -> dict[str, Any]:
        with file.open("rb") as stream:
            response = self._send(
                "POST",
                path,
                params={"name": file.name, **query},
                content=iter(lambda: stream.read(1 << 20), b""),
                headers={"Content-Type": kind},
            )
        return dict(response.json())

    def _send(self, method: str, path: str, **options: Any) -> httpx2.Response:
        try:
            response = self._http.request(method, path, **options)
        except httpx2.ConnectError as error:
            raise ConnectionFailed(
                f"Nobody answers at {self._http.base_url}; start the service with 'ergocast serve'."
            ) from error
        if response.is_success:
            return response
        try:
            problem = response.json()
        except ValueError:
            problem = {"detail": response.text[:200]}
        raise _ERRORS.get(response.status_code, ApiError)(response.status_code, problem)


__all__: Sequence[str] = [
    "AccessError",
    "ApiError",
    "Client",
    "ClientError",
    "ConflictError",
    "ConnectionFailed",
    "FormatError",
    "MissingError",
    "OperationFailed",
    "RequestRejected",
    "TooLargeError",
]
