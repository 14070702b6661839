"""The exact solution of `elimination`, compiled for the processor that it runs on."""

from estimation.kernel.batch import Call, Results, doubtful, results, solve_frames, supports
from estimation.kernel.machine_code import (
    KernelState,
    Solve,
    compile_kernel,
    kernel_state,
    loaded_kernel,
)
from estimation.kernel.sensor_tables import Observations, Tables, tables

__all__ = [
    "Call",
    "KernelState",
    "Observations",
    "Results",
    "Solve",
    "Tables",
    "compile_kernel",
    "doubtful",
    "kernel_state",
    "loaded_kernel",
    "results",
    "solve_frames",
    "supports",
    "tables",
]
