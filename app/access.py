"""Who may call: API keys where they are set, and no other site's page through a browser."""

import hashlib
import hmac
from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from app.problem_handlers import problem_response
from app.problems import Forbidden, Problem, Unauthorized
from app.settings import is_loopback

#: Paths that need no key: the page's own files, health, the schema, texts on problem types.
_GUARDED = "/v1"


class Access:
    """ASGI layer that answers 401 without a valid key and 403 to a foreign page.

    Without keys the service listens on loopback only; a page of another site could still reach it
    through the user's browser. Such a request carries that site's ``Origin``, or, with a host name
    that the site points at this machine, a ``Host`` that is not loopback. Both are refused.
    """

    def __init__(self, app: ASGIApp, keys: tuple[str, ...]) -> None:
        """Wraps ``app``; ``keys`` empty means that no key is asked for."""
        self._app = app
        self._digests = tuple(hashlib.sha256(key.encode()).digest() for key in keys)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Passes the request on, or answers with the problem."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        problem = self._refusal(scope["path"], Headers(scope=scope))
        if problem is None:
            await self._app(scope, receive, send)
        else:
            await problem_response(problem, scope["path"])(scope, receive, send)

    def _refusal(self, path: str, headers: Headers) -> Problem | None:
        host = headers.get("host", "")
        origin = headers.get("origin")
        if origin is not None and _address(origin)[0] != host:
            return Forbidden(f"A page of {origin} may not use this service.")
        if not self._digests:
            _, name = _address(f"//{host}")
            if not is_loopback(name):
                return Forbidden(
                    f"This service is for its own machine; {name!r} is not a name of it. "
                    "Use 127.0.0.1 or localhost."
                )
            return None
        if path != _GUARDED and not path.startswith(_GUARDED + "/"):
            return None
        scheme, _, key = headers.get("authorization", "").partition(" ")
        digest = hashlib.sha256(key.strip().encode()).digest()
        matches = [hmac.compare_digest(digest, known) for known in self._digests]
        if scheme.lower() == "bearer" and any(matches):
            return None
        return Unauthorized(
            "Send the header 'Authorization: Bearer KEY' with a key this service knows.",
            headers={"WWW-Authenticate": "Bearer"},
        )


def _address(url: str) -> tuple[str, str]:
    """Returns the host with its port, and without; nothing where there is none to be read."""
    try:
        parts = urlsplit(url)
        return parts.netloc, parts.hostname or ""
    except ValueError:
        return "", ""
