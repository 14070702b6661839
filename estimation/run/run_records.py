"""What goes into and comes out of the estimate of a recording: settings, chunks, summary."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from enum import IntEnum
from typing import Any, Literal

import numpy as np

from estimation.covariances import ModelCovariances
from estimation.errors import EstimationError
from estimation.estimate_record import Method
from estimation.model_uncertainty import ModelErrors
from estimation.payload import Definition
from estimation.spatial import Array, BoolArray, IntArray
from estimation.stance_calibration import StanceCalibration

#: Of the quantiles in chunks and holds.
QUANTILES = (0.05, 0.5, 0.95)

FreeHands = Literal["auto", "both", "right", "left", "none"]
#: ``noise``: bands hold the sensors' noise. ``noise_and_model``: errors of the model, too.
#: ``tuning``: a preset's, which cover little. ``none``: there are none.
RunBands = Literal["noise", "noise_and_model", "tuning", "none"]


class RunSettingsError(EstimationError):
    """A setting of the run makes no sense; ``setting`` names it."""

    def __init__(self, setting: str, message: str) -> None:
        """Keeps the setting's name beside the message."""
        super().__init__(f"{setting}: {message}")
        self.setting = setting


class RunInputError(EstimationError):
    """A stretch does not fit the run: other joints, other times, no stance to weigh."""


class HandState(IntEnum):
    """What a hand does at a frame."""

    #: No load was found in it.
    FREE = 0
    #: It bears a load.
    LOADED = 1
    #: It cannot be told: no balance, or only that some hand is loaded.
    UNKNOWN = 2


class Balance(IntEnum):
    """Whether the body's balance could be drawn up at a frame."""

    #: All that the ground does to both feet is known.
    KNOWN = 0
    #: Only the sum under both feet: all above the legs is known, the legs are not.
    SPLIT_UNKNOWN = 1
    #: A foot stands where nothing measures, something else than plates bears the person, or there
    #: are no foot forces at all.
    UNKNOWN = 2


@dataclass(frozen=True, slots=True)
class RunSettings:
    """How a recording is estimated.

    Attributes:
        method: ``one_step``, ``two_step`` or ``deterministic``, as for `estimate`.
        free_hands: which hands may hold something. ``auto``: both if there are foot forces, else
            none, because then nothing tells.
        definition: which kilograms the payload of each frame is; holds have all three.
        tare_s: start and end, s, of a stretch in which the person stands still and bears nothing:
            body mass is set so that the plates balance there.
        unobserved: segments whose posture nothing ever measured; the motion's flags name those
            that were lost for a while.
        covariances: of the model's equations and of derived accelerations.
        model_errors: how wrong masses, lengths, angles and plates may be, drawn once a run: bands
            are widened by what follows. None: bands hold the sensors' noise alone.
        hand_force_sd_n: how hard an unmeasured load may push on a free hand, N.
        hand_moment_sd_nm: the same of its moment about the hand's centre, N m: the load's weight
            times how far beside the hand its centre may be.
        loaded_kg: hands that bear more are loaded. Those of which this is not sure are taken to
            bear what may have gone unnoticed, and the arms' torques are worked out again with that.
        least_hold_s: shorter stretches of one state of the hands are no hold.
        known_within_n: a joint whose moment is known no better than if a force of this size were
            missing at the far end of the limb beyond it is marked unknown; so is a payload that is
            known no better than this.
        leave_out_flags: frames of the motion with one of these flags are left out.
        seed: of the draws of model errors.

    Raises:
        RunSettingsError: a value makes no sense.
    """

    method: Method = "one_step"
    free_hands: FreeHands = "auto"
    definition: Definition = "inertial"
    tare_s: tuple[float, float] | None = None
    unobserved: tuple[str, ...] = ()
    covariances: ModelCovariances = field(default_factory=ModelCovariances)
    model_errors: ModelErrors | None = field(default_factory=ModelErrors)
    hand_force_sd_n: float = 300.0
    hand_moment_sd_nm: float = 1.0
    loaded_kg: float = 0.5
    least_hold_s: float = 1.0
    known_within_n: float = 30.0
    leave_out_flags: tuple[str, ...] = ("unfitted", "weak_derivative")
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuses what makes no sense."""
        for name in (
            "hand_force_sd_n",
            "hand_moment_sd_nm",
            "loaded_kg",
            "least_hold_s",
            "known_within_n",
        ):
            value = getattr(self, name)
            if not 0.0 < value < float("inf"):
                raise RunSettingsError(name, f"expected more than zero, got {value}")
        if self.tare_s is not None and not self.tare_s[0] < self.tare_s[1]:
            raise RunSettingsError(
                "tare_s", f"expected start before end in seconds, got {self.tare_s}"
            )


@dataclass(frozen=True, slots=True, eq=False)
class RunChunk:
    """Some consecutive estimated frames of a run; frames left out have no row.

    Wrenches act on the person, in world axes about the foot's or hand's own origin, force first.
    Standard deviations are None for ``deterministic``. What is not marked known is finite, and
    worth as little as its standard deviation says.

    Attributes:
        time_s: ``(n,)`` s, the motion's.
        frames: ``(n,)`` counted over all that was added to the run.
        torque_nm: ``(n, n_dof)`` N m, columns as the model's ``dof_names``.
        torque_sd_nm: as ``torque_nm``.
        torque_known: as ``torque_nm``, whether it can be told at all.
        effort_nm: ``(n, m, 3)`` N m, 5, 50 and 95 % quantile of the norm of each joint's moment,
            columns as `RunSummary.joint_names`; without bands thrice the norm.
        effort_known: ``(n, m)``.
        low_back_force_n: ``(n, 3)`` N, L5S1, pelvis on trunk, axes of the segment above.
        low_back_force_sd_n: as the force.
        low_back_moment_nm: ``(n, 3)`` N m about the joint's centre.
        low_back_moment_sd_nm: as the moment.
        low_back_known: ``(n,)``.
        foot_wrench: ``(n, 2, 6)`` N, N m, right and left.
        foot_wrench_sd: as ``foot_wrench``.
        hand_wrench: ``(n, 2, 6)`` N, N m, right and left.
        hand_wrench_sd: as ``hand_wrench``.
        payload_kg: ``(n, 3)`` kg, 5, 50 and 95 % quantile of what all free hands bear together;
            without bands thrice the mass; zero where no hand is free.
        payload_known: ``(n,)``; False where no hand is free.
        hand_kg: ``(n, 2)`` kg of the right and the left hand.
        hand_kg_sd: as ``hand_kg``.
        hand_kg_known: ``(n, 2)`` whether one hand's part can be told; the sum can far more often.
        hand_state: ``(n, 2)`` a `HandState` each, of the right and the left hand.
        hands_state: ``(n,)`` the same of both together, which can be told more often.
        loaded_probability: ``(n,)`` that the hands together bear more than ``loaded_kg``; zero
            where no hand is free.
        balance: ``(n,)`` a `Balance` each.
        residual_n: ``(n, 3)`` N, world axes: what motion and measured wrenches leave over, free
            hands taken to bear nothing.
        residual_nm: ``(n, 3)`` N m, the same about the pelvis.
    """

    time_s: Array
    frames: IntArray
    torque_nm: Array
    torque_sd_nm: Array | None
    torque_known: BoolArray
    effort_nm: Array
    effort_known: BoolArray
    low_back_force_n: Array
    low_back_force_sd_n: Array | None
    low_back_moment_nm: Array
    low_back_moment_sd_nm: Array | None
    low_back_known: BoolArray
    foot_wrench: Array
    foot_wrench_sd: Array | None
    hand_wrench: Array
    hand_wrench_sd: Array | None
    payload_kg: Array
    payload_known: BoolArray
    hand_kg: Array
    hand_kg_sd: Array | None
    hand_kg_known: BoolArray
    hand_state: IntArray
    hands_state: IntArray
    loaded_probability: Array
    balance: IntArray
    residual_n: Array
    residual_nm: Array

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.time_s)

    @classmethod
    def joined(cls, chunks: "Sequence[RunChunk]") -> "RunChunk":
        """Returns chunks of one run, in order, as one."""
        values: dict[str, Any] = {}
        for item in fields(cls):
            parts = [getattr(chunk, item.name) for chunk in chunks]
            values[item.name] = None if parts[0] is None else np.concatenate(parts)
        return cls(**values)

    def with_rows(self, rows: IntArray, other: "RunChunk") -> "RunChunk":
        """Returns the chunk with some rows taken from another, made of those frames alone."""
        values: dict[str, Any] = {}
        for item in fields(self):
            value = getattr(self, item.name)
            if value is not None:
                value = value.copy()
                value[rows] = getattr(other, item.name)
            values[item.name] = value
        return RunChunk(**values)


@dataclass(frozen=True, slots=True)
class HoldMass:
    """The mass borne during a hold, by one definition.

    Attributes:
        definition: ``inertial``, ``vertical`` or ``norm``, as for `Payload`.
        mass_kg: kg.
        sd_kg: kg, its standard deviation; None without bands.
        quantiles_kg: ``(p05, p50, p95)`` kg, or None.
    """

    definition: Definition
    mass_kg: float
    sd_kg: float | None
    quantiles_kg: tuple[float, float, float] | None


@dataclass(frozen=True, slots=True)
class PayloadHold:
    """A stretch in which the hands' state does not change.

    Attributes:
        state: ``FREE`` or ``LOADED``.
        hands: those free to bear, such as ``("right", "left")``: the masses are their sum.
        start_s: first frame.
        end_s: last frame.
        frames: how many were used; those next to a change are not.
        masses: by each definition, ``inertial`` first.
        split_kg: each hand's part by the inertial definition, or None where only the sum shows.
    """

    state: HandState
    hands: tuple[str, ...]
    start_s: float
    end_s: float
    frames: int
    masses: tuple[HoldMass, ...]
    split_kg: tuple[float, ...] | None

    def mass(self, definition: Definition = "inertial") -> HoldMass:
        """Returns the mass by one definition."""
        return next(mass for mass in self.masses if mass.definition == definition)


@dataclass(frozen=True, slots=True)
class RunSummary:
    """What a whole run comes to.

    Attributes:
        dof_names: columns of torques.
        joint_names: columns of efforts.
        definition: which kilograms the chunks hold.
        free_hands: those taken to be free to bear.
        frames: how many were estimated.
        left_out: reason to how many frames were not.
        holds: in order of time.
        bands: what the bands hold.
        body_mass_kg: the model's, after the tare.
        tare: what the unloaded stance said, or None.
        plates_minus_model_kg: 5, 50 and 95 % quantile, over frames with a known balance, of what
            the plates bear beyond body mass, moved as it moves: payload and error of body mass
            together. None without such frames.
        joint_known_share: ``joint_names`` to the share of frames in which it is known.
        assumed: what was assumed or derived instead of measured.
        findings: what does not fit, in words with times.
    """

    dof_names: tuple[str, ...]
    joint_names: tuple[str, ...]
    definition: Definition
    free_hands: tuple[str, ...]
    frames: int
    left_out: Mapping[str, int]
    holds: tuple[PayloadHold, ...]
    bands: RunBands
    body_mass_kg: float
    tare: StanceCalibration | None
    plates_minus_model_kg: tuple[float, float, float] | None
    joint_known_share: Mapping[str, float]
    assumed: tuple[str, ...]
    findings: tuple[str, ...]
