"""The estimator's kernel: compiled for this processor, so that no program ever waits for it."""

from __future__ import annotations

import hashlib
import platform

from devtools.checkout import Checkout
from devtools.commands import call


def compile_kernel(checkout: Checkout) -> None:
    """Compiles the kernel unless it was compiled from the same code; a second or two."""
    folder = checkout.root / "estimation" / "kernel"
    if not folder.is_dir():
        return
    sources = [
        hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.glob("*.py"))
    ]
    kept = sorted((folder / "__pycache__").glob("kernel-*.bin")) or [folder / "nothing"]
    checkout.step(
        "kernel",
        [sources, platform.machine(), checkout.project()],
        kept,
        lambda: call(
            [checkout.python, "-c", "from estimation import compile_kernel; compile_kernel()"],
            "The estimator's kernel could not be compiled.",
            "report this with what is printed above; estimates work without it, slowly",
            env=checkout.env,
        ),
    )
