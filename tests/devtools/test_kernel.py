"""The kernel's step: taken once for the same code, and again when what it made is gone."""

from pathlib import Path

import pytest

from devtools import kernel
from devtools.checkout import Checkout


def test_the_kernel_is_compiled_once_and_again_when_it_is_gone(
    checkout: Checkout, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken: list[str] = []
    folder = checkout.root / "estimation" / "kernel"

    def compiled(argv: list[object], *rest: object, **options: object) -> None:
        taken.append(str(argv[-1]))
        (folder / "__pycache__" / "kernel-0.bin").write_bytes(b"")

    monkeypatch.setattr(kernel, "call", compiled)
    kernel.compile_kernel(checkout)
    assert taken == []
    Path(folder / "__pycache__").mkdir(parents=True)
    (folder / "whole.py").write_text("1")
    for _ in range(2):
        kernel.compile_kernel(checkout)
    assert len(taken) == 1
    (folder / "__pycache__" / "kernel-0.bin").unlink()
    kernel.compile_kernel(checkout)
    assert len(taken) == 2
    (folder / "whole.py").write_text("2")
    kernel.compile_kernel(checkout)
    assert len(taken) == 3
    assert "compile_kernel()" in taken[0]
