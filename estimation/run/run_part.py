"""Some frames of a recording, as a run works on them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from estimation.estimate_inputs import of_frames
from estimation.sensors import Measurement
from estimation.spatial import Array, BoolArray, IntArray


@dataclass(frozen=True, slots=True)
class RunPart:
    """Some frames of a stretch, with what was measured on the body at them.

    Attributes:
        time_s: ``(n,)`` s.
        q: ``(n, 7 + n_dof)``, as a `Motion` has it; so are ``v`` and ``a``.
        v: ``(n, 6 + n_dof)``.
        a: ``(n, 6 + n_dof)``.
        propped: ``(n,)`` whether something else than plates and feet bears a part of the person.
        unseen: segments to the frames ``(n,)`` on which nothing measured their posture.
        imus: what else was measured at these frames.
    """

    time_s: Array
    q: Array
    v: Array
    a: Array
    propped: BoolArray
    unseen: Mapping[str, BoolArray]
    imus: tuple[Measurement, ...]

    def select(self, rows: IntArray) -> "RunPart":
        """Returns some of the frames."""
        cut = (of_frames(sensor, rows, len(self.time_s)) for sensor in self.imus)
        return RunPart(
            self.time_s[rows],
            self.q[rows],
            self.v[rows],
            self.a[rows],
            self.propped[rows],
            {name: where[rows] for name, where in self.unseen.items() if np.any(where[rows])},
            tuple(cut),
        )
