"""torch without gigabytes of CUDA: the decision, on reports as pip writes them."""

import json
from pathlib import Path

import pytest

from devtools.commands import Stop
from devtools.torch_build import torch_commands, wants_cuda

TORCH = "torch>=2.6,<2.14"
CPU_NEEDS = ["filelock", "sympy>=1.13.3", 'optree>=0.13.0; extra == "optree"']
CUDA_NEEDS = [*CPU_NEEDS, 'nvidia-cudnn-cu13==9.20; platform_system == "Linux"']


def report(needs: list[str] | None) -> dict[str, object]:
    """What pip reports of a dry run that chose a torch with these requirements."""
    return {"version": "1", "install": [{"metadata": {"name": "torch", "requires_dist": needs}}]}


@pytest.mark.parametrize(
    ("needs", "machine", "cuda"),
    [
        (CPU_NEEDS, "x86_64", False),
        (None, "x86_64", False),
        (CUDA_NEEDS, "x86_64", True),
        (['triton==3.7.1; platform_system == "Linux"'], "x86_64", True),
        (['cuda-bindings<14,>=13; platform_system == "Linux"'], "aarch64", True),
        (['nvidia-nccl-cu12==2; platform_machine == "x86_64"'], "aarch64", False),
        (['nvidia-nccl-cu12==2; platform_machine == "x86_64"'], "x86_64", True),
        (['nvidia-ml-py; extra == "profiling"'], "x86_64", False),
    ],
)
def test_cuda_is_seen_in_pips_report(needs: list[str] | None, machine: str, cuda: bool) -> None:
    assert wants_cuda(report(needs), machine) is cuda


@pytest.mark.parametrize(
    ("choice", "system", "needs", "through_uv"),
    [
        ("cpu", "Linux", CPU_NEEDS, False),
        ("cpu", "Linux", CUDA_NEEDS, True),
        ("cpu", "Darwin", CUDA_NEEDS, False),
        ("cuda", "Linux", CUDA_NEEDS, False),
    ],
)
def test_uv_installs_torch_only_when_pip_would_bring_cuda(
    choice: str, system: str, needs: list[str], through_uv: bool
) -> None:
    commands = torch_commands(
        Path("python"),
        TORCH,
        choice=choice,
        system=system,
        machine="x86_64",
        report=json.dumps(report(needs)),
    )
    assert commands[-1][-1] == TORCH
    assert ("--torch-backend=cpu" in commands[-1]) is through_uv
    assert len(commands) == (2 if through_uv else 1)


def test_torch_may_be_left_out() -> None:
    none = torch_commands(
        Path("python"), TORCH, choice="none", system="Linux", machine="x86_64", report=None
    )
    assert none == []


@pytest.mark.parametrize(("choice", "word"), [("gpu", "ERGOCAST_TORCH"), ("cpu", "network")])
def test_no_torch_to_be_had_is_said(choice: str, word: str) -> None:
    with pytest.raises(Stop) as stop:
        torch_commands(
            Path("python"), TORCH, choice=choice, system="Linux", machine="x86_64", report=None
        )
    assert word in f"{stop.value.problem} {stop.value.remedy}"
