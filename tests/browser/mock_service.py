"""Serves the built page with the made-up scene, so that the page can be tested alone.

Run as a module it stays up: ``python -m tests.browser.mock_service`` shows the page on port 8000.
"""

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, unquote, urlsplit

from tests.browser import estimate_scene, scene

STATIC = Path(__file__).resolve().parents[2] / "app" / "static"
_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript",
    ".css": "text/css",
    ".svg": "image/svg+xml",
    ".woff2": "font/woff2",
}

BAD_REQUEST: dict[str, Any] = {
    "type": "/problems/malformed-request",
    "title": "The request does not fit its schema",
    "status": 422,
    "detail": "1 fault",
    "errors": [
        {
            "pointer": "/candidates/0/time_s/2",
            "detail": "Times must increase.",
            "expected": "more than 0.2",
            "got": 0.1,
        }
    ],
}
BAD_RECORDING: dict[str, Any] = {
    "type": "/problems/unknown-format",
    "title": "Not a motion recording",
    "status": 415,
    "detail": "The file starts like neither MVNX nor BVH.",
}


#: Heights, m, with which an estimate goes on until it is cancelled, or fails.
ENDLESS_M, FAILING_M = 1.99, 1.11


class Work:
    """An estimate in the making: three looks at it, and it is done."""

    def __init__(self, request: dict[str, Any]) -> None:
        self.request = request
        self.looks = 0
        self.cancelled = False

    def operation(self) -> dict[str, Any]:
        """Returns the operation as it is now."""
        self.looks += 1
        found: dict[str, Any] = {"id": "o-demo", "kind": "estimate", "state": "running"}
        found["progress"] = {"done": self.looks, "total": 4, "message": "Fitting the body"}
        if self.cancelled:
            return {**found, "state": "cancelled", "problem": {"title": "Cancelled", "status": 409}}
        if self.request["height_m"] == ENDLESS_M or self.looks < 3:
            return found
        if self.request["height_m"] == FAILING_M:
            return {**found, "state": "failed", "problem": estimate_scene.PROBLEM}
        return {**found, "state": "succeeded", "result_url": "/v1/estimates/e-demo"}


class Handler(BaseHTTPRequestHandler):
    """Answers the page's requests from the scene."""

    #: The estimate asked for last; of all pages alike, since tests go one by one.
    work = Work({"height_m": 1.76})

    protocol_version = "HTTP/1.1"

    def log_message(self, format: str, *args: Any) -> None:
        """Says nothing: a test's output is its own."""

    def do_GET(self) -> None:
        path = unquote(urlsplit(self.path).path)
        made = scene.assessment()
        listed = {key: made[key] for key in ("id", "name", "created", "model_id")}
        answers: dict[str, Any] = {
            "/v1/assessments": {"items": [{**listed, "n_candidates": len(made["candidates"])}]},
            "/v1/assessments/a-demo": made,
            "/v1/models/m-demo": scene.MODEL,
            "/v1/recordings": {"items": [scene.RECORDING]},
            "/v1/estimates": {"items": [estimate_scene.summary({})]},
        }
        if path in answers:
            self._json(200, answers[path])
        elif path == "/v1/models/m-demo/urdf":
            self._send(200, "text/xml", scene.urdf().encode())
        elif path.startswith("/v1/assessments/a-demo/candidates/"):
            self._json(200, scene.posture(path.split("/")[5]))
        elif path == "/v1/operations/o-demo":
            self._json(200, Handler.work.operation())
        elif path == "/v1/estimates/e-demo":
            self._json(200, estimate_scene.summary(Handler.work.request))
        elif path == "/v1/estimates/e-demo/series":
            wanted = parse_qs(urlsplit(self.path).query)["columns"][0]
            self._json(200, estimate_scene.part(wanted.split(",")))
        elif path == "/v1/estimates/e-demo/series.parquet":
            self._send(200, "application/vnd.apache.parquet", b"PAR1")
        elif path.startswith("/v1/"):
            self._problem({"title": "Not found", "status": 404, "detail": f"Nothing at {path}."})
        else:
            self._file(path)

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["content-length"] or 0))
        path = urlsplit(self.path).path
        if path == "/v1/recordings":
            if body.startswith(b"HIERARCHY"):
                self._json(201, scene.RECORDING)
            else:
                self._problem(BAD_RECORDING)
        elif path == f"/v1/recordings/{scene.RECORDING['id']}/files":
            self._json(201, scene.RECORDING)
        elif path == "/v1/estimates":
            Handler.work = Work(json.loads(body))
            self._json(202, {"id": "o-demo"}, location="/v1/operations/o-demo")
        elif path == "/v1/operations/o-demo/cancel":
            Handler.work.cancelled = True
            self._json(200, {"id": "o-demo"})
        elif path == "/v1/scores":
            self._json(200, scene.score(json.loads(body)))
        elif path == "/v1/assessments":
            request = json.loads(body)
            if request.get("model_id") == "m-demo":
                self._json(200, scene.assessment())
            else:
                self._problem(BAD_REQUEST)
        else:
            self._problem({"title": "Not found", "status": 404})

    def _file(self, path: str) -> None:
        file = (STATIC / (path.lstrip("/") or "index.html")).resolve()
        if not file.is_file() or STATIC not in file.parents:
            self._send(404, "text/plain", b"")
            return
        self._send(200, _TYPES.get(file.suffix, "application/octet-stream"), file.read_bytes())

    def _problem(self, problem: dict[str, Any]) -> None:
        self._json(problem["status"], problem, "application/problem+json")

    def _json(
        self, status: int, body: Any, kind: str = "application/json", location: str = ""
    ) -> None:
        self._send(status, kind, json.dumps(body).encode(), location)

    def _send(self, status: int, kind: str, body: bytes, location: str = "") -> None:
        self.send_response(status)
        if location:
            self.send_header("location", location)
        self.send_header("content-type", kind)
        self.send_header("content-length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)


@contextmanager
def served(port: int = 0) -> Iterator[str]:
    """Serves the page and the scene while open; gives its address."""
    server = ThreadingHTTPServer(("127.0.0.1", port), Handler)
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


if __name__ == "__main__":
    with served(8000) as address:
        print(address)
        threading.Event().wait()
