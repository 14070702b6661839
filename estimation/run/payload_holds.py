"""The payload of a whole hold: many frames say far more than one, but for what no frame tells."""

from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtri, stdtrit

from estimation.norm_quantiles import norm_quantiles
from estimation.payload import Definition
from estimation.run.run_records import QUANTILES, HandState, HoldMass, PayloadHold
from estimation.spatial import GRAVITY_MS2, Array, BoolArray, IntArray, inverse, times

#: So much after a change of state, and before the next, the load may be half borne, s.
SETTLE_S = 0.4
#: Frames are summed over blocks of this length, s.
BLOCK_S = 0.2
#: A hold is cut into so many parts, or fewer where it is short: by how they differ shows how far
#: errors of neighbouring frames hang together. Fewer than the second number tell nothing: then all
#: frames are taken to share one error.
PARTS, LEAST_PARTS = 10, 5


@dataclass(frozen=True, slots=True)
class HoldFrames:
    """Some consecutive frames of the free hands' load.

    Attributes:
        time_s: ``(n,)`` s.
        state: ``(n,)`` a `HandState` each, of all free hands together.
        force: ``(n, 3)`` N, world axes, on the person, all free hands together.
        covariance: ``(n, 3, 3)`` N^2, noise alone.
        pull: ``(n, 3)`` m/s^2, world axes, proper acceleration of the hands.
        deviation: ``(pairs, n, 3)`` N, what drawn models change; no pairs without them.
        parts: ``(n, hands, 3)`` N, world axes, each hand's force.
        parts_known: ``(n,)`` whether those can be told.
    """

    time_s: Array
    state: IntArray
    force: Array
    covariance: Array
    pull: Array
    deviation: Array
    parts: Array
    parts_known: BoolArray


@dataclass(slots=True)
class _Block:
    """Sums over the frames of one block.

    ``weight`` and ``moment`` are those of the mass and of weight times mass in least squares,
    ``moments`` the latter for each pair's deviation; ``parts`` sums ``-a'F`` of each hand.
    """

    number: int
    end_s: float
    parts_known: bool
    sums: dict[str, Array]

    def add(self, other: "_Block") -> None:
        self.end_s = other.end_s
        self.parts_known &= other.parts_known
        self.sums = {name: self.sums[name] + other.sums[name] for name in self.sums}


@dataclass(slots=True)
class HoldCollector:
    """Cuts a run into holds and weighs each; frames come in order, in any portions.

    Attributes:
        hands: the free ones.
        least_s: shorter holds are dropped.
        widening: factor on the spread of drawn models.
    """

    hands: tuple[str, ...]
    least_s: float
    widening: float = 1.0
    _blocks: list[_Block] = field(default_factory=list)
    _state: HandState = HandState.UNKNOWN
    _since_s: float = 0.0
    _last_s: float = 0.0

    def take(self, frames: HoldFrames) -> list[PayloadHold]:
        """Returns the holds that end within the next frames."""
        out = []
        edges = np.flatnonzero(np.diff(frames.state)) + 1
        for part in np.split(np.arange(len(frames.time_s)), edges):
            if not len(part):
                continue
            state = HandState(frames.state[part[0]])
            if state != self._state:
                out.extend(self.close())
                self._state, self._since_s = state, float(frames.time_s[part[0]])
            self._last_s = float(frames.time_s[part[-1]])
            settled = part[frames.time_s[part] >= self._since_s + SETTLE_S]
            if state != HandState.UNKNOWN and len(settled):
                self._gather(frames, settled)
        return out

    def _gather(self, frames: HoldFrames, rows: IntArray) -> None:
        number = np.floor((frames.time_s[rows] - self._since_s) / BLOCK_S).astype(np.intp)
        edges = np.flatnonzero(np.diff(number)) + 1
        for part, same in zip(np.split(rows, edges), np.split(number, edges), strict=True):
            block = _block(frames, part, int(same[0]))
            if self._blocks and self._blocks[-1].number == block.number:
                self._blocks[-1].add(block)
            else:
                self._blocks.append(block)

    def close(self) -> list[PayloadHold]:
        """Ends the hold that is going on; returns it if it is long enough."""
        state, since, last = self._state, self._since_s, self._last_s
        blocks = [block for block in self._blocks if block.end_s <= last - SETTLE_S]
        self._blocks, self._state = [], HandState.UNKNOWN
        if not blocks or last - since < self.least_s:
            return []
        groups = np.array_split(np.arange(len(blocks)), min(PARTS, len(blocks)))
        sums = {
            name: np.array([sum(blocks[i].sums[name] for i in group) for group in groups])
            for name in blocks[0].sums
        }
        whole = {name: np.sum(value, axis=0) for name, value in sums.items()}
        split = None
        if all(block.parts_known for block in blocks):
            split = tuple((whole["parts"] / whole["pull_squared"]).tolist())
        return [
            PayloadHold(
                state=state,
                hands=self.hands,
                start_s=since,
                end_s=last,
                frames=int(whole["frames"]),
                masses=(self._inertial(sums, whole), *self._of_the_mean(sums, whole)),
                split_kg=split,
            )
        ]

    def _inertial(self, sums: dict[str, Array], whole: dict[str, Array]) -> HoldMass:
        weight, moment = sums["weight"], sums["moment"]
        mass = float(whole["moment"] / whole["weight"])
        variance = 1.0 / float(whole["weight"])
        if len(weight) >= LEAST_PARTS:
            scatter = np.sum((moment - weight * mass) ** 2 / weight) / (len(weight) - 1)
            variance *= max(1.0, _few(len(weight)) * float(scatter))
        else:
            variance *= float(whole["frames"])
        pairs = whole["moments"] / whole["weight"]
        if len(pairs):
            variance += self.widening**2 * float(np.mean(pairs**2))
        return _gaussian("inertial", mass, float(np.sqrt(variance)))

    def _of_the_mean(
        self, sums: dict[str, Array], whole: dict[str, Array]
    ) -> tuple[HoldMass, HoldMass]:
        count = whole["frames"]
        force = whole["force"] / count
        covariance = whole["covariance"] / count**2
        if len(sums["frames"]) >= LEAST_PARTS:
            apart = (sums["force"] - sums["frames"][:, None] * force) / count
            scatter = apart.T @ apart * (_few(len(apart)) * len(apart) / (len(apart) - 1))
            if np.trace(scatter) > np.trace(covariance):
                covariance = scatter
        else:
            covariance = count * covariance
        pairs = whole["forces"] / count
        if len(pairs):
            covariance = covariance + self.widening**2 * pairs.T @ pairs / len(pairs)
        vertical = float(-force[2] / GRAVITY_MS2)
        length = float(np.linalg.norm(force))
        along = force / max(length, 1e-9)
        low, middle, high = norm_quantiles(force, covariance, QUANTILES) / GRAVITY_MS2
        spread = float(np.sqrt(along @ covariance @ along)) / GRAVITY_MS2
        return (
            _gaussian("vertical", vertical, float(np.sqrt(covariance[2, 2])) / GRAVITY_MS2),
            HoldMass(
                "norm", length / GRAVITY_MS2, spread, (float(low), float(middle), float(high))
            ),
        )


def _few(parts: int) -> float:
    """What makes 95 % of a variance that is known from a few parts only: Student's t, squared."""
    return float(stdtrit(parts - 1, 0.975) / ndtri(0.975)) ** 2


def _gaussian(definition: Definition, mass: float, sd: float) -> HoldMass:
    low, middle, high = (mass + sd * float(ndtri(p)) for p in QUANTILES)
    return HoldMass(definition, mass, sd, (low, middle, high))


def _block(frames: HoldFrames, rows: IntArray, number: int) -> _Block:
    """Sums what one block needs.

    Derived here: generalized least squares for ``m`` in ``F = -m a + noise`` of covariance ``C``:
    ``m = -sum a'C^-1 F / sum a'C^-1 a``.
    """
    pull, force = frames.pull[rows], frames.force[rows]
    weighted = times(inverse(frames.covariance[rows]), pull)
    deviation = frames.deviation[:, rows]
    sums = {
        "frames": np.array(float(len(rows))),
        "weight": np.sum(weighted * pull),
        "moment": -np.sum(weighted * force),
        "moments": -np.einsum("ni,pni->p", weighted, deviation),
        "force": np.sum(force, axis=0),
        "covariance": np.sum(frames.covariance[rows], axis=0),
        "forces": np.sum(deviation, axis=1),
        "pull_squared": np.sum(pull**2),
        "parts": -np.einsum("ni,nhi->h", pull, frames.parts[rows]),
    }
    end = float(frames.time_s[rows[-1]])
    return _Block(number, end, bool(np.all(frames.parts_known[rows])), sums)
