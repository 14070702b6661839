"""Which build of torch to install: the CPU one, without gigabytes of CUDA on a laptop.

The default index for Linux serves a build that brings the CUDA packages along, and no file of ours
may name another index. So pip is asked what it would take, and only when that is a CUDA build does
uv, which knows where the CPU builds are, do the installing.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path

from devtools.commands import Stop


def wants_cuda(report: Mapping[str, object], machine: str) -> bool:
    """Tells whether the torch that pip would take on Linux brings CUDA packages along.

    Args:
        report: pip's installation report of a dry run for torch alone.
        machine: The processor's name, as in a requirement's ``platform_machine``.

    Returns:
        Whether one of its requirements for this processor is a CUDA or Triton package.
    """
    chosen = report.get("install")
    for item in chosen if isinstance(chosen, list) else []:
        for requirement in item["metadata"].get("requires_dist") or []:
            name, _, marker = requirement.partition(";")
            foreign = re.search(r"platform_machine\s*==\s*[\"']([^\"']+)", marker)
            if "extra" in marker or (foreign and foreign.group(1) != machine):
                continue
            if re.match(r"(nvidia-|cuda-|triton\b|pytorch-triton)", name.strip()):
                return True
    return False


def torch_commands(
    python: Path, torch: str, *, choice: str, system: str, machine: str, report: str | None
) -> list[list[str]]:
    """Returns the commands that install torch, without CUDA unless it was asked for.

    Args:
        python: The environment's interpreter.
        torch: The package with its bounds, from ``pyproject.toml``.
        choice: ``ERGOCAST_TORCH``: ``cpu``, ``cuda`` (take what pip takes) or ``none``.
        system: The operating system's name; only Linux has CUDA builds on the default index.
        machine: The processor's name.
        report: pip's dry-run report as JSON, or nothing when pip found no torch at all.

    Raises:
        Stop: The choice is unknown, or there is no torch for this Python and machine.
    """
    if choice not in ("cpu", "cuda", "none"):
        raise Stop(
            f"ERGOCAST_TORCH is {choice!r}, not cpu, cuda or none.",
            "unset ERGOCAST_TORCH (the CPU build is the default) and run the command again",
        )
    if choice == "none":
        return []
    if report is None:
        raise Stop(
            f"pip finds no {torch} for this Python and machine, or has no network.",
            "once the network is there, run the command again; on a machine that torch does not "
            "support set ERGOCAST_TORCH=none: only the gpytorch engine needs it",
        )
    plain = [str(python), "-m", "pip", "install", "--quiet", torch]
    if choice == "cuda" or system != "Linux" or not wants_cuda(json.loads(report), machine):
        return [plain]
    # uv knows where the CPU builds are, so that no host stands in our sources.
    uv = [str(python), "-m", "uv", "pip", "install", "--quiet", "--python", str(python)]
    return [
        [str(python), "-m", "pip", "install", "--quiet", "uv"],
        [*uv, "--torch-backend=cpu", torch],
    ]
