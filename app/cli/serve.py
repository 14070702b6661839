"""``ergocast serve``."""

import errno
import socket
from pathlib import Path
from typing import Annotated

import typer
from pydantic import ValidationError

from app.cli.output import Json, print_json
from app.problems import ConfigurationError
from app.settings import Settings, check_bind

Data = Annotated[
    Path | None, typer.Option("--data", help="Folder for everything kept. [default: .ergocast]")
]


def settings_for(data: Path | None) -> Settings:
    """Returns the settings of the environment, with the data folder given on the command line.

    Raises:
        ConfigurationError: A variable of the environment holds what it cannot.
    """
    try:
        return Settings() if data is None else Settings(data=data)
    except ValidationError as error:
        first = error.errors()[0]
        name = "ERGOCAST_" + "_".join(str(part) for part in first["loc"]).upper()
        raise ConfigurationError(f"{name}={first['input']}: {first['msg']}.") from error


def listen(host: str, port: int) -> socket.socket:
    """Returns a socket that listens.

    Raises:
        ConfigurationError: The port is taken, or the address is not this machine's.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    server = socket.socket(family, socket.SOCK_STREAM)
    server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        server.bind((host, port))
        server.listen(128)
    except OSError as error:
        server.close()
        if error.errno == errno.EADDRINUSE:
            raise ConfigurationError(
                f"Port {port} on {host} is taken by another program. "
                f"Choose another: ergocast serve --port {port + 1}"
            ) from error
        raise ConfigurationError(
            f"Cannot listen on {host}, port {port}: {error.strerror or error}."
        ) from error
    return server


def serve(
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 takes a free one.")] = 8000,
    data: Data = None,
    as_json: Json = False,
) -> None:
    """Serves the dashboard and the API until stopped."""
    import uvicorn

    from app.main import create_app
    from app.service import ErgocastService
    from estimation import compile_kernel

    settings = settings_for(data)
    check_bind(host, settings)
    # Here, where an error is one line: inside the server it would be a traceback.
    ErgocastService(settings).prepare()
    # Before anyone listens: no request and no live stream ever waits for a compiler.
    compile_kernel()
    server = listen(host, port)
    shown = f"[{host}]" if ":" in host else host
    url = f"http://{shown}:{server.getsockname()[1]}"
    if as_json:
        print_json({"url": url, "data": str(settings.data)})
    else:
        typer.echo(f"Ergocast listens on {url} (data in {settings.data}; stop with Ctrl-C)")
    config = uvicorn.Config(create_app(settings), log_level="warning", timeout_graceful_shutdown=5)
    try:
        uvicorn.Server(config).run(sockets=[server])
    except KeyboardInterrupt:
        # uvicorn raises it again after its own orderly end.
        typer.echo("Stopped.", err=True)
    finally:
        server.close()


def register(cli: typer.Typer) -> None:
    """Adds the command."""
    cli.command()(serve)
