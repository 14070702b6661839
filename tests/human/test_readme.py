import re
from pathlib import Path

import numpy as np

README = Path(__file__).parents[2] / "human" / "README.md"


def test_first_example_works_as_pasted():
    (code,) = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    names: dict[str, object] = {}
    exec(code, names)  # the project's own text
    effort = names["effort"]
    assert isinstance(effort, np.ndarray)
    assert effort.shape == (1000, 2)
    # 5 kg on a straight arm of some 0.62 m, and the arm's own weight.
    assert 5.0 * 9.81 * 0.55 < effort[0, 1] < 5.0 * 9.81 * 0.75 + 20.0
