"""Refuses bodies larger than the service takes, before and while they come."""

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.problem_handlers import problem_response
from app.problems import TooLarge


class BodyLimit:
    """ASGI layer that answers 413, as problem+json like every other error.

    JSON is held in memory and has a limit of its own; anything else is an upload, streamed to disk.
    """

    def __init__(self, app: ASGIApp, json_bytes: int, upload_bytes: int) -> None:
        """Wraps ``app``; at most ``json_bytes`` of JSON and ``upload_bytes`` of anything else."""
        self._app = app
        self._json_bytes = json_bytes
        self._upload_bytes = upload_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Passes the request on, counting what comes, or answers with the problem."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        is_json = "json" in headers.get("content-type", "json")
        limit = self._json_bytes if is_json else self._upload_bytes
        detail = f"The body is larger than {limit} bytes; nothing was kept."
        stated = headers.get("content-length", "")
        if stated.isdigit() and int(stated) > limit:
            await problem_response(TooLarge(detail), scope["path"])(scope, receive, send)
            return
        got = 0

        async def counted() -> Message:
            nonlocal got
            message = await receive()
            got += len(message.get("body", b""))
            if got > limit:
                # The framework lets this kind through, where it wraps any other.
                raise HTTPException(413, detail)
            return message

        await self._app(scope, counted, send)
