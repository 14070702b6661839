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
from urllib.parse import unquote, urlsplit

from tests.browser import scene

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


class Handler(BaseHTTPRequestHandler):
    """Answers the page's requests from the scene."""

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
        }
        if path in answers:
            self._json(200, answers[path])
        elif path == "/v1/models/m-demo/urdf":
            self._send(200, "text/xml", scene.urdf().encode())
        elif path.startswith("/v1/assessments/a-demo/candidates/"):
            self._json(200, scene.posture(path.split("/")[5]))
        elif path.startswith("/v1/"):
            self._problem({"title": "Not found", "status": 404, "detail": f"Nothing at {path}."})
        else:
            self._file(path)

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["content-length"]))
        path = urlsplit(self.path).path
        if path == "/v1/recordings":
            if body.startswith(b"HIERARCHY"):
                self._json(201, scene.RECORDING)
            else:
                self._problem(BAD_RECORDING)
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

    def _json(self, status: int, body: Any, kind: str = "application/json") -> None:
        self._send(status, kind, json.dumps(body).encode())

    def _send(self, status: int, kind: str, body: bytes) -> None:
        self.send_response(status)
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
