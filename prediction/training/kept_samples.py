"""The motion a model was trained on, kept in it so that more can be added.

It is personal data: how one person moved, by name or not. Whoever has the model file has it.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from prediction.chain import TaskChain
from prediction.demonstrations import Demonstrations, demonstrations_from_samples
from prediction.errors import DemonstrationError

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TakeSource:
    """Where a take came from.

    Attributes:
        name: What its owner calls it.
        sha256: Digest of its file; empty if it is not known.
    """

    name: str
    sha256: str = ""


@dataclass(frozen=True, slots=True)
class KeptTake:
    """One take of the training data.

    Attributes:
        name: What its owner calls it.
        file_sha256: Digest of its file; empty if it is not known.
        samples_sha256: Digest of its postures and velocities.
        samples: How many.
        duration_s: From the first to the last.
    """

    name: str
    file_sha256: str
    samples_sha256: str
    samples: int
    duration_s: float


@dataclass(frozen=True, slots=True)
class KeptSamples:
    """Training samples of all joints, without Jacobians: the chain gives those again.

    Attributes:
        q: ``(N, n)`` rad.
        qdot: ``(N, n)`` rad/s.
        time_s: ``(N,)`` s.
        takes: In the order of the samples.
    """

    q: Array
    qdot: Array
    time_s: Array
    takes: tuple[KeptTake, ...]

    @classmethod
    def of(
        cls, demonstrations: Demonstrations, sources: Sequence[TakeSource] = ()
    ) -> "KeptSamples":
        """Takes the samples.

        Args:
            demonstrations: All joints.
            sources: One per take, in their order; numbered names if none are given.

        Raises:
            DemonstrationError: Their number is not that of the takes, or a take is there twice.
        """
        ids = demonstrations.trajectory_id
        starts = [0, *(np.flatnonzero(np.diff(ids)) + 1).tolist(), len(ids)]
        pieces = [slice(a, b) for a, b in pairwise(starts)]
        if not sources:
            sources = [TakeSource(f"take {number}") for number in range(1, len(pieces) + 1)]
        if len(sources) != len(pieces):
            raise DemonstrationError(
                f"{len(sources)} sources for {len(pieces)} takes: one is needed each"
            )
        takes = []
        for piece, source in zip(pieces, sources, strict=True):
            time_s = demonstrations.time_s[piece]
            digest = hashlib.sha256("\n".join(demonstrations.joint_names).encode())
            digest.update(np.ascontiguousarray(demonstrations.q[piece]).tobytes())
            digest.update(np.ascontiguousarray(demonstrations.qdot[piece]).tobytes())
            takes.append(
                KeptTake(
                    source.name,
                    source.sha256,
                    digest.hexdigest(),
                    len(time_s),
                    float(time_s[-1] - time_s[0]),
                )
            )
        _refuse_repeats(takes)
        return cls(demonstrations.q, demonstrations.qdot, demonstrations.time_s, tuple(takes))

    @property
    def sources(self) -> tuple[TakeSource, ...]:
        """Where the takes came from."""
        return tuple(TakeSource(take.name, take.file_sha256) for take in self.takes)

    def demonstrations(self, chain: TaskChain) -> Demonstrations:
        """Returns the samples as demonstrations of the chain they were taken from."""
        counts = [take.samples for take in self.takes]
        ids = np.repeat(np.arange(len(counts)), counts)
        return demonstrations_from_samples(chain, self.q, self.qdot, self.time_s, ids)


def _refuse_repeats(takes: Sequence[KeptTake]) -> None:
    """Refuses a take that is there twice: it would count as held-out motion of itself."""
    seen: dict[str, str] = {}
    for take in takes:
        for digest in filter(None, (take.file_sha256, take.samples_sha256)):
            if digest in seen:
                raise DemonstrationError(
                    f"{take.name} is the same recording as {seen[digest]}, already among the "
                    "demonstrations: leave it out, a motion seen twice makes bands too narrow"
                )
            seen[digest] = take.name
