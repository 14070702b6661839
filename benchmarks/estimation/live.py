"""The streaming estimator at 240 Hz, in a process of its own, from its first breath.

Run ``python -m benchmarks.estimation.live`` for the table; it is part of
`benchmarks.estimation.core`, too. Times are the processor's, since the machine may be shared; what
the clock on the wall says stands beside them. Every tenth of a second a covariance changes.
"""

import json
import subprocess
import sys
import time

RATE_HZ = 240.0
SECONDS = 5.0


def fresh_process(engine: str) -> dict[str, float]:
    """Streams in a new process; returns what it measured.

    Args:
        engine: ``kernel`` or ``numpy``.
    """
    start = time.perf_counter()
    argv = [sys.executable, "-m", "benchmarks.estimation.live", engine]
    with subprocess.Popen(argv, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        scene = float(process.stdout.readline())
        first = time.perf_counter() - start - scene
        found: dict[str, float] = json.loads(process.stdout.readline())
    return {"first by the clock": first, **found}


def stream(engine: str) -> dict[str, float]:
    """Streams frames at their own pace; times in ms."""
    import numpy as np

    from benchmarks.estimation.moving_scene import moving_scene
    from estimation import Estimator, FreeWrench, real_tree
    from human import Subject, generate_model

    model = generate_model(Subject(1.76, 74.3, "male"))
    # The scene stands for what a camera would send: making it is no part of the estimator's time.
    clock, processor = time.perf_counter(), time.process_time()
    scene = moving_scene(model, 64, np.random.default_rng(0))
    sensors = {f"sensor {place}": sensor for place, sensor in enumerate(scene.sensors)}
    every = [
        {
            name: np.asarray(sensor.value)[frame]
            for name, sensor in sensors.items()
            if not isinstance(sensor, FreeWrench)
        }
        for frame in range(len(scene.q))
    ]
    scene_by_processor = time.process_time() - processor
    scene_by_clock = time.perf_counter() - clock
    live = Estimator(real_tree(model), sensors, engine=engine)  # type: ignore[arg-type]
    live.step(scene.q[0], scene.v[0], every[0])
    first = time.process_time() - scene_by_processor
    print(scene_by_clock, flush=True)
    by_processor, by_clock, late = [], [], 0
    hand = next(name for name, sensor in sensors.items() if isinstance(sensor, FreeWrench))
    start = time.perf_counter()
    for count in range(int(SECONDS * RATE_HZ)):
        due = start + count / RATE_HZ
        time.sleep(max(0.0, due - time.perf_counter()))
        frame = count % len(every)
        clock, processor = time.perf_counter(), time.thread_time()
        if count % 24 == 12:
            live.change({hand: FreeWrench("RightHandCOM", 50.0 + count % 48)})
        live.step(scene.q[frame], scene.v[frame], every[frame])
        by_processor.append(1e3 * (time.thread_time() - processor))
        by_clock.append(1e3 * (time.perf_counter() - clock))
        late += time.perf_counter() > due + 1.0 / RATE_HZ
    return {
        "first": first,
        "median": float(np.median(by_processor)),
        "p99": float(np.quantile(by_processor, 0.99)),
        "median by the clock": float(np.median(by_clock)),
        "p99 by the clock": float(np.quantile(by_clock, 0.99)),
        "late": late / len(by_clock),
    }


def main() -> int:
    """Streams if told how, else prints the table of a fresh process."""
    if len(sys.argv) > 1:
        print(json.dumps(stream(sys.argv[1])), flush=True)
        return 0
    from estimation import compile_kernel

    compile_kernel()
    for name, value in fresh_process("kernel").items():
        print(f"{name:40} {value:.3f}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
