"""Serves the built dashboard, or a page that says how to build it."""

from pathlib import Path

from fastapi import FastAPI, Response
from fastapi.responses import FileResponse, HTMLResponse
from fastapi.staticfiles import StaticFiles

#: Where ``npm run build`` puts the page.
STATIC = Path(__file__).parent / "static"

_NOT_BUILT = """<!doctype html>
<html lang="en"><meta charset="utf-8"><title>Ergocast</title>
<body style="font: 16px/1.5 system-ui, sans-serif; max-width: 40rem; margin: 4rem auto">
<h1>Ergocast is running</h1>
<p>The dashboard has not been built in this checkout. Run <code>python3 dev.py run</code>, which
builds it, or <code>npm ci &amp;&amp; npm run build</code> in <code>web/</code>.</p>
<p>The API is there: <a href="/docs">its pages</a>, <a href="/openapi.json">its schema</a>.</p>
</body></html>
"""


def install(app: FastAPI, folder: Path = STATIC) -> None:
    """Mounts the page at ``/``; call it after the API's routes, which come first."""
    if (folder / "index.html").is_file():

        @app.get("/", include_in_schema=False)
        def page() -> Response:
            """Returns the dashboard; asked for anew each time, since its parts are hashed."""
            return FileResponse(folder / "index.html", headers={"Cache-Control": "no-cache"})

        app.mount("/", StaticFiles(directory=folder), name="dashboard")
    else:

        @app.get("/", include_in_schema=False)
        def not_built() -> Response:
            """Returns the page that says how to build the dashboard."""
            return HTMLResponse(_NOT_BUILT)
