"""The papers' tasks, simulated: who does what, for how long, with which load."""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np

from benchmarks.estimation.papers.measuring import Measured, measured
from estimation import Estimate
from human import HumanModel, Subject, generate_model
from human.simulate import (
    Operator,
    Posture,
    SimulatedMotion,
    Stance,
    Station,
    operator,
    simulate_box_handling,
    simulate_postures,
    simulate_walking,
)

#: Both papers record at this rate.
RATE_HZ = 50.0
TPOSE_KG, CARRIED_KG = 5.0, 9.55
#: Numbers of the postures in `truth.segment_id`: standing unloaded, and the T-pose.
UNLOADED, TPOSE = 0, 2
#: The arms of who carries with both hands in front, right side, degrees; the left is mirrored.
_IN_FRONT = {"Shoulder_rotx": 75.0, "Shoulder_rotz": 25.0, "Elbow_rotz": 80.0}
_SIDES = (("Right", 1.0), ("Left", -1.0))


class Scenes:
    """All tasks of one person; each is made when it is first asked for.

    Args:
        seed: of everything random.
        length: of the times for which postures are held; 1 is as long as the papers', roughly.
        urdf: folder with IIT's subject models, if at hand.
    """

    def __init__(self, seed: int = 0, length: float = 1.0, urdf: Path | None = None) -> None:
        """Takes what makes the tasks differ."""
        self.seed = seed
        self.length = length
        self.urdf = urdf
        self._estimates: dict[tuple[str, str], Estimate] = {}

    def estimate_once(self, task: str, how: str, make: Callable[[], Estimate]) -> Estimate:
        """Returns an estimate that several figures need, made when it is first asked for."""
        if (task, how) not in self._estimates:
            self._estimates[task, how] = make()
        return self._estimates[task, how]

    @cached_property
    def model(self) -> HumanModel:
        """A person as big as subject 3 of the published models, whom 2021 seems to show."""
        return generate_model(Subject(1.80, 75.4, "male"))

    @cached_property
    def person(self) -> Operator:
        """How this person moves."""
        return operator("average", self._rng(0), self.model)

    @cached_property
    def tasks(self) -> dict[str, Measured]:
        """2019, Table 1: T1 to T4, on shoes."""
        hold = self.length * 3.0
        double = Posture(hold_s=hold)
        rng = self._rng(1)
        moves = {
            "T1": self._postures([double, double], rng),
            "T2": self._postures([double, Posture(2.0, 1.5 * hold, "right")], rng),
            "T3": self._postures([double, Posture(2.0, 1.5 * hold, "left")], rng),
            "T4": simulate_walking(
                self.model,
                self.person,
                rng,
                route=(Stance(), Stance(x=1.0 + 3.5 * self.length)),
                rate_hz=RATE_HZ,
            ),
        }
        return {name: measured(name, self.model, move, rng) for name, move in moves.items()}

    @cached_property
    def tpose_unloaded(self) -> Measured:
        """2021, Fig. 5b: both arms up to the T-pose and down again, on plates."""
        return self._tpose(("Right", "Left"), 0.0, self._rng(2))

    @cached_property
    def tpose_loaded(self) -> Measured:
        """2021, Fig. 5c: the right arm up to the T-pose with 5 kg, on plates."""
        return self._tpose(("Right",), TPOSE_KG, self._rng(3))

    @cached_property
    def balancing(self) -> Measured:
        """2021, Fig. 6: takes 9.55 kg up, stands on the left foot, then on the right, on shoes."""
        arms = {
            f"j{side}{joint}": sign * np.deg2rad(degrees)
            for joint, degrees in _IN_FRONT.items()
            for side, sign in _SIDES
        }
        hold = 2.0 * self.length
        stoop = Posture(1.5, 0.3, angles=arms, drop_m=0.15, pitch_rad=0.5)
        carry = Posture(1.5, hold, angles=arms, load=1.0)
        postures = [
            Posture(hold_s=1.5 * hold),
            stoop,
            replace(stoop, move_s=0.6, load=1.0),
            carry,
            replace(carry, move_s=2.0, feet="left"),
            replace(carry, move_s=2.0, hold_s=0.5),
            replace(carry, move_s=2.0, feet="right"),
            replace(carry, move_s=2.0),
        ]
        rng = self._rng(4)
        half = dict.fromkeys(("RightHandCOM", "LeftHandCOM"), 0.5 * CARRIED_KG)
        move = self._postures(postures, rng, half)
        return measured("quasi-static", self.model, move, rng)

    @cached_property
    def carrying(self) -> Measured:
        """2021, Fig. 7: takes 9.55 kg up in front, walks on with it, puts it down, on shoes."""
        rng = self._rng(5)
        way = 1.0 + 2.0 * self.length
        stations = (
            Station((0.42, 0.0, 0.5)),
            Station((way + 0.4, 0.0, 0.9), Stance(x=way)),
        )
        move = simulate_box_handling(
            self.model,
            self.person,
            rng,
            stations=stations,
            box_kg=CARRIED_KG,
            rate_hz=RATE_HZ,
        )
        return measured("walking", self.model, move, rng)

    @cached_property
    def tpose_exact(self) -> Measured:
        """The same as `tpose_loaded`, with sensors that do not err."""
        move = self.tpose_loaded.simulated
        return measured("T-pose", self.model, move, self._rng(3), feet="plates", exact=True)

    def _tpose(self, sides: tuple[str, ...], load_kg: float, rng: np.random.Generator) -> Measured:
        level = {
            f"j{side}{joint}": 0.0
            for side in sides
            for joint in ("Shoulder_rotx", "Shoulder_rotz", "Elbow_rotz")
        }
        hold = 3.0 * self.length
        postures = [
            Posture(hold_s=0.7 * hold),
            Posture(0.8, 0.2, load=1.0),
            Posture(2.0, hold, angles=level, load=1.0),
            Posture(2.0, 0.7 * hold, load=1.0),
        ]
        move = self._postures(postures, rng, {"RightHandCOM": load_kg})
        return measured("T-pose", self.model, move, rng, feet="plates")

    def _postures(
        self,
        postures: list[Posture],
        rng: np.random.Generator,
        load_kg: dict[str, float] | None = None,
    ) -> SimulatedMotion:
        return simulate_postures(
            self.model, self.person, rng, postures, load_kg=load_kg, rate_hz=RATE_HZ
        )

    def _rng(self, number: int) -> np.random.Generator:
        return np.random.default_rng([self.seed, number])
