"""How long an assessment takes, part by part: ``python -m benchmarks.assessments``.

Times are those of one thread (``OMP_NUM_THREADS=1``) in processor seconds, which a busy machine
lengthens less than it does wall time. The aim is about a second for 100 candidates of 50 points.
"""

import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from app.assessments.assess import assess
from app.assessments.schemas import DEFAULT_SAMPLES, AssessmentRequest
from app.demo.scene import person
from app.files import dump_json
from app.models.operator import Operator, open_operator
from app.training import Recorded, train
from human.simulate import robot_trajectories, simulate_following
from prediction import TakeSource, TrainingOptions, save_model

CANDIDATES, POINTS, STEP_S = 100, 50, 0.04
AIM_S = 1.0


def timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """Returns what ``work`` returns and the processor seconds it took."""
    start = time.process_time()
    result = work()
    return result, time.process_time() - start


def trained_operator(folder: Path) -> tuple[Operator, Any]:
    """Returns a quickly trained operator and the scene the candidates come from."""
    who = person()
    rng = np.random.default_rng(0)
    scene = robot_trajectories(
        who.model, who.operator, rng, count=10, points=POINTS, duration_s=(POINTS - 1) * STEP_S
    )
    motions = [
        simulate_following(
            who.model, who.operator, way.path(), rng, q_start=scene.q_start, rate_hz=30.0
        ).motion
        for way in scene.trajectories
    ]
    options = TrainingOptions(method="mi-nsgp", optimizer="gradient", blocks=2, max_samples=350)
    sources = tuple(TakeSource(way.id) for way in scene.trajectories)
    recorded = Recorded(who.model, tuple(motions), sources, ())
    trained = train(recorded, "right", seed=0, options=options)
    save_model(folder / "operator.safetensors", trained.operator)
    return open_operator(folder / "operator.safetensors"), scene


def request(operator: Operator, scene: Any, count: int, samples: int) -> AssessmentRequest:
    """Returns a request of ``count`` candidates of `POINTS` points."""
    q = scene.q_start
    ways = scene.trajectories
    return AssessmentRequest.model_validate(
        {
            "model_id": operator.id,
            "start": {
                "T_world_pelvis": {
                    "position_m": q[:3].tolist(),
                    "orientation_xyzw": q[3:7].tolist(),
                },
                "joint_position": dict(zip(operator.model.dof_names, q[7:].tolist(), strict=True)),
            },
            "payload_kg": 4.0,
            "samples": samples,
            "candidates": [
                {
                    "id": f"{ways[k % len(ways)].id}-{k}",
                    "time_s": ways[k % len(ways)].time_s.tolist(),
                    "position_m": ways[k % len(ways)].position_m.tolist(),
                    "orientation_xyzw": ways[k % len(ways)].orientation_xyzw.tolist(),
                }
                for k in range(count)
            ],
        }
    )


def main() -> None:
    """Prints the figures."""
    with TemporaryDirectory() as folder:
        operator, scene = trained_operator(Path(folder))
        assess(request(operator, scene, 1, 2), operator)
        print(f"{'candidates':>10} {'points':>6} {'samples':>7} {'CPU s':>8} {'MB':>6}")
        for count, samples in (
            (1, DEFAULT_SAMPLES),
            (10, DEFAULT_SAMPLES),
            (CANDIDATES, 8),
            (CANDIDATES, DEFAULT_SAMPLES),
        ):
            asked = request(operator, scene, count, samples)
            outcome, seconds = timed(lambda asked=asked: assess(asked, operator))  # type: ignore[misc]
            size = len(dump_json(outcome.result)) / 1e6
            print(f"{count:>10} {POINTS:>6} {samples:>7} {seconds:>8.2f} {size:>6.2f}")
        verdict = "pass" if seconds <= AIM_S else "fail"
        print(
            f"aim: {CANDIDATES} x {POINTS} at {DEFAULT_SAMPLES} samples in {AIM_S:g} s: {verdict}"
        )


if __name__ == "__main__":
    main()
