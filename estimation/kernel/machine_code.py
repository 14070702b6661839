"""The kernel for this processor: compiled on request, kept on disk, loaded in milliseconds.

Nothing here compiles unless `compile_kernel` is called, so that no process that serves frames as
they come waits for a compiler. What is kept is found again by a digest of the kernel's own code,
the compiler's version and the processor; anything else is never loaded.

What is loaded is run, so it is trusted as the package's own code is: only a file that nobody may
write but this process's user, the administrator and the owner of the package.
"""

import hashlib
import os
import platform
import stat
import sys
import tempfile
from collections.abc import Callable
from ctypes import CFUNCTYPE, c_int64, c_void_p
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Any

import llvmlite
import llvmlite.binding as llvm

from estimation.kernel.layout import NAME

#: Of a kept file: the digest of its name and the rest, so that neither half a file nor another
#: version's is taken for this one's.
_DIGEST_BYTES = 32
Solve = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class KernelState:
    """Whether the compiled kernel is there.

    Attributes:
        ready: whether `estimate` and `Estimator` use it in this process.
        path: the file that it is kept in, or None.
        reason: in words, and what to do if it is not there.
    """

    ready: bool
    path: Path | None
    reason: str


@dataclass(slots=True)
class _Loaded:
    """What this process has loaded; the engine owns the memory that ``solve`` points into."""

    solve: Solve | None = None
    path: Path | None = None
    reason: str = ""
    engine: Any = None
    tried: bool = False


def _sources() -> bytes:
    """Returns a digest of the code that writes the kernel and of the code that calls it."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.digest()


#: Of the code that this process runs, whatever an upgrade puts in its place meanwhile.
_OWN_SOURCES = _sources()
_loaded = _Loaded()
#: Two threads that ask first must both get the kernel.
_loading = Lock()


def kernel_state() -> KernelState:
    """Says whether the compiled kernel is used in this process, and where from."""
    _load()
    return KernelState(_loaded.solve is not None, _loaded.path, _loaded.reason)


def loaded_kernel() -> Solve | None:
    """Returns the compiled kernel if there is one for this processor; never compiles."""
    _load()
    return _loaded.solve


def compile_kernel() -> KernelState:
    """Compiles the kernel unless a current one is kept; about a second.

    Call it where waiting is no harm: when a service starts, before a long job, at installation.
    Where nothing can be written, the kernel serves this process alone.
    """
    _load()
    with _loading:
        if _loaded.solve is None and _sources() != _OWN_SOURCES:
            # Half of the kernel would be the old version's and half the new one's.
            _loaded.reason = "the package has changed since this process began: start it again"
        elif _loaded.solve is None:
            code = _compiled()
            _take(code)
            _loaded.path, kept = _keep(code)
            _loaded.reason = f"compiled in this process; {kept}"
    return kernel_state()


def folders() -> tuple[Path, ...]:
    """Returns where the kernel may be kept, best first: with the package, or with the user."""
    user = "Library/Caches" if sys.platform == "darwin" else ".cache"
    beside, own = Path(__file__).parent / "__pycache__", Path(os.path.expanduser(f"~/{user}"))
    # Without a home, "~" stays as it is.
    return (beside, own / "ergocast") if own.is_absolute() else (beside,)


def _load() -> None:
    """Loads what is kept, once a process; does not wait for who compiles meanwhile."""
    if _loaded.tried:
        return
    with _loading:
        if not _loaded.tried:
            _find()
            _loaded.tried = True


def _find() -> None:
    name = _file_name()
    refused = ""
    for folder in folders():
        path = folder / name
        try:
            if not path.is_file():
                continue
            with path.open("rb") as file:
                problem = _distrust(os.fstat(file.fileno()))
                content = b"" if problem else file.read()
        except OSError:
            continue
        if problem:
            refused = refused or f"{path} is not loaded: {problem}; "
            continue
        code = content[_DIGEST_BYTES:]
        if code and _digest(name, code) == content[:_DIGEST_BYTES]:
            _take(code)
            _loaded.path, _loaded.reason = path, f"loaded from {path}"
            return
    _loaded.reason = (
        f"{refused}no compiled kernel for this processor: estimates are made with numpy, some 30 "
        "times as slow; estimation.compile_kernel() makes one in about a second"
    )


def _distrust(found: os.stat_result) -> str:
    """Says why a file may be somebody else's code; nothing if it may not.

    Who owns the package or administers the machine could change what runs here anyhow.
    """
    if not hasattr(os, "geteuid"):
        return ""
    trusted = {0, os.geteuid(), _package_owner()}
    if found.st_uid not in trusted:
        return f"it belongs to user {found.st_uid}"
    if found.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return "others may write it"
    return ""


def _package_owner() -> int:
    return Path(__file__).stat().st_uid


def _digest(name: str, code: bytes) -> bytes:
    return hashlib.sha256(name.encode() + code).digest()


def _take(code: bytes) -> None:
    """Makes machine code callable."""
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine())
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    signature = CFUNCTYPE(None, c_void_p, c_int64)
    _loaded.solve, _loaded.engine = signature(engine.get_function_address(NAME)), engine


def _keep(code: bytes) -> tuple[Path | None, str]:
    """Writes machine code into the first folder that takes it, whole or not at all."""
    problem, name = "", _file_name()
    for folder in folders():
        try:
            folder.mkdir(parents=True, exist_ok=True)
            _write(folder / name, _digest(name, code) + code)
        except OSError as error:
            problem = problem or str(error)
            continue
        return folder / name, f"kept as {folder / name}"
    return None, f"not kept ({problem})"


def _write(path: Path, content: bytes) -> None:
    with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
        new = Path(file.name)
        try:
            file.write(content)
        except OSError:
            new.unlink()
            raise
    # Made by one user, such as at installation, it serves all.
    new.chmod(0o644)
    new.replace(path)


@cache
def _file_name() -> str:
    """Names the file after all that the machine code depends on."""
    digest = hashlib.sha256(_OWN_SOURCES)
    for word in (
        llvmlite.__version__,
        platform.system(),
        platform.machine(),
        llvm.get_host_cpu_name(),
        llvm.get_host_cpu_features().flatten(),
    ):
        digest.update(word.encode())
    return f"kernel-{digest.hexdigest()[:24]}.bin"


def _machine() -> Any:
    """The processor that this runs on, with all it can do; an engine takes it over for good."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(),
        features=llvm.get_host_cpu_features().flatten(),
        opt=3,
        codemodel="jitdefault",
        jit=True,
    )


def _compiled() -> bytes:
    # Only who compiles pays for the parts that write code.
    from estimation.kernel.whole import kernel_code

    machine = _machine()
    wide = bool(llvm.get_host_cpu_features().get("avx512f", False))
    module = llvm.parse_assembly(kernel_code(wide))
    module.verify()
    return bytes(machine.emit_object(module))
