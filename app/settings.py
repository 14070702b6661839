"""Settings of the service: one class, read from ``ERGOCAST_*`` in the environment.

Every default works with no file and no network.
"""

import ipaddress
from pathlib import Path

from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict

from app.problems import ConfigurationError


class Settings(BaseSettings):
    """What can be set from outside; see each field for its meaning and unit."""

    model_config = SettingsConfigDict(env_prefix="ERGOCAST_", extra="ignore")

    #: Folder that holds everything the service keeps (models, recordings, results).
    data: Path = Path(".ergocast")
    #: Comma-separated keys; when given, every ``/v1`` request must carry one of them.
    api_keys: str = Field(default="", repr=False)
    #: Largest upload, in bytes.
    max_upload_bytes: int = Field(default=1 << 30, gt=0)
    #: Largest JSON request body, in bytes.
    max_body_bytes: int = Field(default=64 << 20, gt=0)
    #: An assessment with more candidate points than this is done in the background.
    sync_point_limit: int = Field(default=20_000, ge=0)
    #: Threads that work on operations.
    workers: int = Field(default=1, ge=1, le=64)
    #: Operations that may wait at once; further ones get 429.
    queue_limit: int = Field(default=64, ge=1)

    @property
    def keys(self) -> tuple[str, ...]:
        """The accepted API keys; empty when none is needed."""
        return tuple(key.strip() for key in self.api_keys.split(",") if key.strip())


def is_loopback(host: str) -> bool:
    """Returns whether binding to ``host`` is reachable from this machine only."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def check_bind(host: str, settings: Settings) -> None:
    """Refuses an address that other machines can reach when no key protects it.

    Args:
        host: Name or address to listen on.
        settings: The settings that may hold keys.

    Raises:
        ConfigurationError: ``host`` is not loopback and no key is set.
    """
    if not is_loopback(host) and not settings.keys:
        raise ConfigurationError(
            f"Refusing to listen on {host}: other machines could reach it without a key. "
            "Set ERGOCAST_API_KEYS to one or more comma-separated secrets, or listen on 127.0.0.1."
        )
