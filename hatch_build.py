"""Puts the built dashboard into the wheel and the source distribution, or says how to build it."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class BundleHook(BuildHookInterface[Any]):
    """Sees to it that whoever installs the result needs no Node."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Builds the dashboard unless it is there and current.

        Args:
            version: ``editable`` in a checkout, where ``dev.py`` builds the dashboard itself.
            build_data: Not changed; ``artifacts`` in ``pyproject.toml`` names the bundle.

        Raises:
            RuntimeError: There is no current bundle and no Node to build one.
        """
        if version == "editable":
            return
        root = Path(self.root)
        # Build front ends run this file from elsewhere; the steps lie beside it.
        sys.path.insert(0, str(root))
        try:
            from devtools import checkout, commands, web
        finally:
            sys.path.remove(str(root))
        here = checkout.Checkout(root)
        if web.is_current(here):
            return
        if not web.node_is_there(here):
            raise RuntimeError(
                "app/static, the built dashboard, is missing or older than web/, and there is no "
                "Node.js >= 20.19 with npm to build it. Run `python3 dev.py setup` here first."
            )
        try:
            web.build_web(here)
        except commands.Stop as stop:
            raise RuntimeError(f"{stop.problem} {stop.remedy}") from stop
