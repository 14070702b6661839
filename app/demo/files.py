"""Writes the demonstration as files, such as a user would have."""

import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from app.demo.laboratory import write_laboratory
from app.demo.scene import candidates, person, request, trained
from app.files import write_bytes, write_json
from app.training import Trained
from human.readers import write_bvh
from human.simulate import simulate_box_handling
from prediction import save_model

Progress = Callable[[str, float], None]

_BOX_SEED = 11
_BOX_KG = 6.0
_LIFT_SEED = 12

_README = """A demonstration, made by Ergocast's own simulator; nobody was recorded.

operator.safetensors   the posture model of one (simulated) person
box_handling.bvh       the same person carrying a box: a recording to inspect and score
static.trc             the same person standing, with markers on
lift.trc, lift_grf.mot taking a box of 5 kg on two force plates: a recording to estimate
request.json           six ways a robot may lead her hand: the body of POST /v1/assessments
context.json           its shared part: where she stands, the load
candidates/            its candidates, one file each

ergocast inspect box_handling.bvh
ergocast score box_handling.bvh --height 1.72 --mass 68 --load 6
ergocast estimate static:static.trc lift.trc grf:lift_grf.mot --height 1.72 --mass 68 --out .
ergocast assess --model operator.safetensors --context context.json candidates/*.json
"""


@dataclass(frozen=True, slots=True)
class DemoFiles:
    """Where the demonstration's files are.

    Attributes:
        folder: All of them.
        trained: The model and how it does on held-out motion.
    """

    folder: Path
    trained: Trained | None

    @property
    def model(self) -> Path:
        """The operator model."""
        return self.folder / "operator.safetensors"

    @property
    def recording(self) -> Path:
        """The recording."""
        return self.folder / "box_handling.bvh"

    @property
    def request(self) -> Path:
        """The assessment request."""
        return self.folder / "request.json"


def write_demo(folder: Path, progress: Progress | None = None) -> DemoFiles:
    """Makes the demonstration; the folder appears whole or not at all.

    Args:
        folder: Where to; files of an earlier demonstration in it are replaced.
        progress: Told what is being done and the share done.
    """
    tell = progress or (lambda what, done: None)
    tell("simulating a person", 0.0)
    who = person()
    scene = candidates(who)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".part-") as name:
        made = Path(name)
        box = simulate_box_handling(
            who.model, who.operator, np.random.default_rng(_BOX_SEED), box_kg=_BOX_KG
        )
        write_bvh(made / "box_handling.bvh", who.model, box.motion)
        write_laboratory(made, who.model, who.operator, np.random.default_rng(_LIFT_SEED))
        model = trained(who, lambda what, done: tell(what, 0.15 + 0.85 * done))
        save_model(made / "operator.safetensors", model.operator)
        body = request(who, scene)
        write_json(made / "request.json", body)
        for one in body["candidates"]:
            write_json(made / "candidates" / f"{one['id']}.json", one)
        context = {key: value for key, value in body.items() if key != "candidates"}
        write_json(made / "context.json", context)
        write_bytes(made / "README.txt", _README.encode())
        if folder.is_dir():
            shutil.copytree(made, folder, dirs_exist_ok=True)
        else:
            made.rename(folder)
            made.mkdir()  # for the context manager to remove
    tell("done", 1.0)
    return DemoFiles(folder, model)
