"""One small simulated operator, trained once a session, and a service on an empty data folder."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from app.main import create_app
from app.models.operator import Operator, open_operator
from app.settings import Settings
from human import Chain, HumanModel, Subject, generate_model
from human.readers import write_bvh
from human.simulate import (
    RobotScene,
    operator,
    robot_trajectories,
    simulate_box_handling,
    simulate_reaching,
)
from prediction import (
    TrainingOptions,
    demonstrations_from_motion,
    save_model,
    train_operator,
)
from tests.app.cli.running import run
from tests.app.estimates.lifting import Lifting, write_lifting

BASE_URL = "http://127.0.0.1:8000"


@dataclass(frozen=True)
class Scene:
    """The simulated person, their model file, and where a robot may lead them."""

    model: HumanModel
    file: Path
    robot: RobotScene

    def candidates(self) -> list[dict[str, Any]]:
        """Returns the robot's trajectories as candidates."""
        return [
            {
                "id": one.id,
                "frame_id": "world",
                "time_s": one.time_s.tolist(),
                "position_m": one.position_m.tolist(),
                "orientation_xyzw": one.orientation_xyzw.tolist(),
            }
            for one in self.robot.trajectories
        ]

    def request(self, model_id: str, **changes: Any) -> dict[str, Any]:
        """Returns a good assessment request with some fields replaced."""
        q = self.robot.q_start
        return {
            "model_id": model_id,
            "hand": "right",
            "start": {
                "T_world_pelvis": {
                    "position_m": q[:3].tolist(),
                    "orientation_xyzw": q[3:7].tolist(),
                },
                "joint_position": dict(zip(self.model.dof_names, q[7:].tolist(), strict=True)),
            },
            "payload_kg": 4.0,
            "payload_share": 0.5,
            "samples": 6,
            "seed": 3,
            "candidates": self.candidates(),
            **changes,
        }


@pytest.fixture(scope="session")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """A person trained with the quick methods alone."""
    model = generate_model(Subject(1.72, 68.0, "female"))
    person = operator("average", np.random.default_rng(7))
    robot = robot_trajectories(
        model, person, np.random.default_rng(1), count=3, points=15, duration_s=1.4
    )
    motion = simulate_reaching(
        model, person, np.random.default_rng(2), movements=6, rate_hz=15.0
    ).motion
    chain = Chain(model)
    trained = train_operator(
        chain,
        demonstrations_from_motion(chain, motion),
        seed=0,
        options=TrainingOptions(method="cov-ik", blocks=2),
    )
    file = tmp_path_factory.mktemp("model") / "operator.safetensors"
    save_model(file, trained)
    return Scene(model, file, robot)


@pytest.fixture(scope="session")
def opened(scene: Scene) -> Operator:
    """The operator model, opened."""
    return open_operator(scene.file)


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    """Settings of a service on an empty data folder."""
    return Settings(data=tmp_path / "data", api_keys="")


@pytest.fixture
def api(settings: Settings) -> Iterator[TestClient]:
    """A running service."""
    with TestClient(create_app(settings), base_url=BASE_URL) as client:
        yield client


@pytest.fixture
def model_id(api: TestClient, scene: Scene) -> str:
    """The operator model, uploaded."""
    answer = api.post(
        "/v1/models?name=operator.safetensors",
        content=scene.file.read_bytes(),
        headers={"Content-Type": "application/vnd.ergocast.model"},
    )
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


@pytest.fixture(scope="session")
def bvh(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of the simulated person carrying a box."""
    person = operator("average", np.random.default_rng(7))
    motion = simulate_box_handling(
        scene.model, person, np.random.default_rng(5), rate_hz=20.0
    ).motion
    file = tmp_path_factory.mktemp("recording") / "box.bvh"
    write_bvh(file, scene.model, motion)
    return file


@pytest.fixture(scope="session")
def reaches(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Two recordings to train on; at 10 Hz, since the roll-outs of a training cost by the step."""
    person = operator("average", np.random.default_rng(7))
    folder = tmp_path_factory.mktemp("recording")
    files = (folder / "one.bvh", folder / "two.bvh")
    for seed, file in enumerate(files):
        rng = np.random.default_rng(20 + seed)
        reached = simulate_reaching(scene.model, person, rng, movements=6, rate_hz=10.0)
        write_bvh(file, scene.model, reached.motion)
    return files


@pytest.fixture(scope="session")
def trained_file(reaches: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The model that ``ergocast train --method cov-ik`` makes of the first."""
    out = tmp_path_factory.mktemp("trained") / "operator.safetensors"
    person = ("--height", 1.72, "--mass", 68, "--sex", "female")
    assert run("train", reaches[0], *person, "--method", "cov-ik", "--out", out) == 0
    return out


@pytest.fixture(scope="session")
def lifting(tmp_path_factory: pytest.TempPathFactory) -> Lifting:
    """A lift in a simulated laboratory: the files and the truth."""
    return write_lifting(tmp_path_factory.mktemp("laboratory"))


def upload(api: TestClient, file: Path) -> str:
    """Uploads a recording and returns its id."""
    answer = api.post(
        f"/v1/recordings?name={file.name}",
        content=file.read_bytes(),
        headers={"Content-Type": "application/octet-stream"},
    )
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])
