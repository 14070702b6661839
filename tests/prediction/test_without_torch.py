"""Training by the fast engine and predicting need no torch."""

import subprocess
import sys
from pathlib import Path

SCRIPT = """
import sys
import numpy as np

class NoTorch:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("torch", "gpytorch", "linear_operator"):
            raise ImportError(f"{name} is not to be imported")

sys.meta_path.insert(0, NoTorch())
sys.path.insert(0, sys.argv[1])
from planar import PlanarChain, planar_demonstrations
from prediction import (
    TrainingOptions, UnsupportedMethodError, add_demonstrations, load_model, save_model,
    train_operator,
)
chain = PlanarChain()
few = planar_demonstrations(seed=3, samples=60)[1]
options = TrainingOptions(tasks=("position",), blocks=2, max_evaluations=40)
save_model(sys.argv[2], train_operator(chain, few.take(slice(0, 50)), seed=0, options=options))
model = load_model(sys.argv[2])
time_s = 0.05 * np.arange(5)
start = chain.arm.forward(few.q[0])
path = start + 0.02 * np.stack([time_s, 0 * time_s], axis=1)
for method in model.method_names:
    run = model.rollout(
        path, None, time_s, few.q[0], 3, np.random.default_rng(0), method=method, chain=chain
    )
    assert np.isfinite(run.q).all()
try:
    train_operator(
        chain, few, seed=0, options=TrainingOptions(engine="gpytorch", method="mi-nsgp")
    )
except ImportError:
    print("gpytorch alone asks for torch")
"""


def test_training_and_prediction_run_where_there_is_no_torch(tmp_path: Path) -> None:
    folder = Path(__file__).parent
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(folder), str(tmp_path / "m.safetensors")],
        capture_output=True,
        text=True,
        cwd=folder.parents[1],
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout.strip() == "gpytorch alone asks for torch"
