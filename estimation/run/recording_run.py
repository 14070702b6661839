"""Estimates a whole recording, stretch by stretch, in memory that does not grow with it."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from estimation.estimate_inputs import of_frames
from estimation.estimate_record import Estimate
from estimation.feet.foot_force_record import FootForces
from estimation.map_estimator import estimate
from estimation.model_uncertainty import (
    ModelDraw,
    ModelSpread,
    draw_models,
    model_spread,
    widened,
)
from estimation.run.hands import HandTracker
from estimation.run.payload_holds import HoldCollector
from estimation.run.run_checks import (
    Findings,
    frames_to_leave_out,
    mark_feet,
    near_singular,
    unseen_segments,
)
from estimation.run.run_chunks import Loads, chunk_of, hold_frames, loads_of
from estimation.run.run_knowledge import joints_known
from estimation.run.run_part import RunPart
from estimation.run.run_records import (
    Balance,
    HandState,
    PayloadHold,
    RunBands,
    RunChunk,
    RunInputError,
    RunSettings,
    RunSummary,
)
from estimation.run.run_sensors import (
    FEET,
    HANDS,
    FootFrames,
    body_sensors,
    both_hands_load,
    empty_hands,
    foot_frames,
    foot_sensors,
    free_hands,
)
from estimation.run.run_tare import tare_stance
from estimation.run.run_words import hold_in_words, mass_in_words, settings_in_words
from estimation.sensors import Measurement, frames_at_fault
from estimation.spatial import GRAVITY_MS2, Array, BoolArray, IntArray, times, transposed
from estimation.stance_calibration import (
    StanceCalibration,
    with_mass,
)
from estimation.tree import EstimationTree, real_tree
from human import HumanModel, Motion
from human.rotations import quaternion_to_matrix

#: Frames that become one chunk.
CHUNK = 2048
_BANDS: dict[str, RunBands] = {
    "uncertainty": "noise",
    "widened": "noise_and_model",
    "tuning": "tuning",
    "none": "none",
}


class RecordingRun:
    """A recording's estimate, fed stretch by stretch; for one stretch use `estimate_run`.

    Stretches follow each other in time and may leave gaps. What the hands did, holds, and findings
    go on from one to the next, so that the same frames in other portions give the same answer.

    Attributes:
        tree: the body that is worked with, after the tare.
        tare: what the unloaded stance said, or None.
    """

    def __init__(
        self,
        model: HumanModel,
        settings: RunSettings | None = None,
        tare: StanceCalibration | None = None,
    ) -> None:
        """Starts a run.

        Args:
            model: the person.
            settings: how to estimate.
            tare: from `tare_stance`, if it was taken elsewhere than in the first stretch.

        Raises:
            UnknownLinkError: a segment said to be unobserved is not one of the model.
        """
        self._settings = settings or RunSettings()
        self._model = model
        self.tree = real_tree(model)
        for name in self._settings.unobserved:
            if name not in model.segment_names:
                raise RunInputError(
                    f"unobserved: expected segments of the model, got {name!r}; known: "
                    f"{', '.join(model.segment_names)}"
                )
        self.tare = tare
        self._hands: tuple[str, ...] | None = None
        self._draws: tuple[ModelDraw, ...] = ()
        self._assumed: list[str] = []
        self._findings = Findings()
        self._holds: list[PayloadHold] = []
        self._left_out: dict[str, int] = {}
        self._frames = self._given = 0
        self._last_s = -np.inf
        self._gaps: list[Array] = []
        self._bands: RunBands = "none"
        turning = [
            joint for joint in range(self.tree.n_links - 1) if len(self.tree.dofs[joint + 1])
        ]
        self._turning = np.array(turning)
        self._known = np.zeros(len(turning))
        self._tracker = HandTracker(self._settings.loaded_kg)
        self._collector = HoldCollector((), self._settings.least_hold_s)

    def add(
        self, motion: Motion, feet: FootForces | None, imus: Sequence[Measurement] = ()
    ) -> Iterator[RunChunk]:
        """Estimates the next stretch, in chunks; close the iterator to give up.

        Args:
            motion: the stretch, after all that was added before.
            feet: the wrenches under the feet at the same frames, or None.
            imus: what else was measured at the same frames.

        Raises:
            RunInputError: other joints than the model's, times that do not go on, foot forces at
                other times, or a tare that is not in this first stretch.
            MeasurementError: a measurement has another shape, or the person moves during the tare.
            CovarianceError: a covariance is not one, or beyond double precision.
        """
        self._check(motion, feet)
        if self._hands is None:
            self._start(motion, feet)
        self._last_s = float(motion.time_s[-1])
        tare_kg = 0.0 if self.tare is None else self.tare.error_kg
        known = foot_frames(feet, len(motion), self.tree.mass_kg, tare_kg)
        mark_feet(self._findings, feet, motion.time_s, known)
        kept = self._kept(motion, imus)
        for joint, where in near_singular(self.tree, motion.q).items():
            self._findings.mark(
                f"{joint} within 5 deg of where two of its axes coincide: its effort holds, how it "
                "is shared out among its torques does not",
                motion.time_s,
                where,
            )
        for segment, where in motion.unseen_segments.items():
            self._findings.mark(
                f"{segment} was not seen: its joint is not known, and its weight is uncertain to "
                "all above",
                motion.time_s,
                where,
            )
        unseen = unseen_segments(motion, self._settings.unobserved)
        whole = RunPart(
            motion.time_s, motion.q, motion.v, motion.a, known.propped, unseen, tuple(imus)
        )
        offset = self._given
        self._given += len(motion)
        for start in range(0, len(kept), CHUNK):
            rows = kept[start : start + CHUNK]
            yield self._chunk(whole.select(rows), feet, known, rows, offset)

    def _check(self, motion: Motion, feet: FootForces | None) -> None:
        if motion.model_dof_names != self._model.dof_names:
            raise RunInputError(
                "motion: expected the model's joint angles, got others; fit it to this model"
            )
        if not motion.time_s[0] > self._last_s:
            raise RunInputError(
                f"motion: expected a stretch after {self._last_s:g} s, got one from "
                f"{motion.time_s[0]:g} s; add stretches in order, each frame once"
            )
        if feet is not None and (
            len(feet.time_s) != len(motion) or np.any(np.abs(feet.time_s - motion.time_s) > 1e-6)
        ):
            raise RunInputError(
                f"foot forces: expected the motion's {len(motion)} times, got {len(feet.time_s)} "
                "times or others; make them with feet_from_plates for this motion"
            )

    def _start(self, motion: Motion, feet: FootForces | None) -> None:
        """Settles what holds for the whole run: tare, free hands, draws."""
        settings = self._settings
        self._hands = free_hands(settings, feet is not None)
        if settings.tare_s is not None and self.tare is None:
            low, high = settings.tare_s
            if low < motion.time_s[0] or high > motion.time_s[-1]:
                raise RunInputError(
                    f"tare from {low:g} to {high:g} s: expected it within the first stretch, "
                    f"{motion.time_s[0]:g} to {motion.time_s[-1]:g} s; or take it with tare_stance "
                    "and pass it on"
                )
            self.tare = tare_stance(self._model, motion, feet, settings.tare_s)
        if self.tare is not None:
            self.tree = with_mass(self.tree, self.tare.mass_kg)
        self._assumed.extend(
            settings_in_words(settings, self._hands, self.tare, self._model.total_mass_kg)
        )
        if self.tare is not None:
            self._weigh(self.tare.error_kg, self._model.total_mass_kg)
        if settings.model_errors is not None and settings.method == "one_step":
            forward = quaternion_to_matrix(motion.q[0, 3:7])[:, 0]
            self._draws = draw_models(
                self.tree,
                settings.model_errors,
                np.random.default_rng(settings.seed),
                plates=FEET if feet is not None else (),
                heading_rad=float(np.arctan2(forward[1], forward[0])),
                body_mass_sd_kg=None if self.tare is None else self.tare.sd_kg,
            )
            self._collector.widening = settings.model_errors.widening
        self._collector.hands = self._hands

    def _kept(self, motion: Motion, imus: Sequence[Measurement]) -> IntArray:
        """Returns the frames that can be estimated, and names the others."""
        out = np.ones(len(motion), dtype=np.bool_)
        reasons = frames_to_leave_out(motion, self._settings.leave_out_flags)
        for sensor, bad in frames_at_fault(imus).items():
            where = np.zeros(len(motion), dtype=np.bool_)
            where[bad] = True
            reasons[f"{sensor} is not finite"] = where
        for reason, where in reasons.items():
            self._left_out[reason] = self._left_out.get(reason, 0) + int(np.count_nonzero(where))
            self._findings.mark(f"left out, {reason}", motion.time_s, where)
            out &= ~where
        return np.flatnonzero(out)

    def _chunk(
        self,
        part: RunPart,
        feet: FootForces | None,
        known: FootFrames,
        rows: IntArray,
        offset: int,
    ) -> RunChunk:
        here = None if feet is None else feet.select(rows)
        ground = foot_sensors(here, known.usable[rows], part.q[:, :3])
        balance = known.balance[rows]
        assert self._hands is not None
        found, wide, spread = self._solved(part, ground, self._hands)
        bearing = loads_of(found, wide, self._settings, balance)
        state, chance = self._follow(found, spread, part.time_s, bearing)
        joints = self._joints(found, part, balance)
        first = chunk_of(wide, part.time_s, rows + offset, balance, joints, bearing, state, chance)
        out = first
        if len(self._hands) > 1:
            for at in (HandState.FREE, HandState.LOADED):
                some = np.flatnonzero((state == at) & bearing.known)
                if len(some):
                    sensors = [of_frames(sensor, some, len(rows)) for sensor in ground]
                    sensors += self._shared(found, bearing, some, at)
                    again, wider, _ = self._solved(part.select(some), sensors, ())
                    joints = self._joints(again, part.select(some), balance[some])
                    better = chunk_of(
                        wider,
                        part.time_s[some],
                        out.frames[some],
                        balance[some],
                        joints,
                        bearing.select(some),
                        state[some],
                        chance[some],
                    )
                    out = out.with_rows(some, better)
        # What is left over is left by the body alone, not once its load has been found.
        out = replace(out, residual_n=first.residual_n, residual_nm=first.residual_nm)
        self._frames += len(rows)
        self._known += np.count_nonzero(out.effort_known, axis=0)
        self._bands = _BANDS[wide.bands]
        weighed = balance != Balance.UNKNOWN
        self._gaps.append(-out.residual_n[weighed, 2] / GRAVITY_MS2)
        return out

    def _shared(
        self, found: Estimate, bearing: Loads, rows: IntArray, state: HandState
    ) -> list[Measurement]:
        """Says how two hands may share what they were found to bear together."""
        settings, load = self._settings, bearing.select(rows)
        turn = transposed(found.link_rotation[rows][:, [found.link(hand) for hand in HANDS]])
        if state == HandState.LOADED:
            force = times(turn, load.force[:, None])
            return both_hands_load(settings, force, load.sd_kg)
        pull = load.pull / np.linalg.norm(load.pull, axis=1, keepdims=True)
        return empty_hands(settings, load.mass_kg, load.sd_kg, times(turn, pull[:, None]))

    def _joints(self, found: Estimate, part: RunPart, balance: IntArray) -> BoolArray:
        settings = self._settings
        known = joints_known(found, balance, part.propped, part.unseen, settings.known_within_n)
        return known[:, self._turning]

    def _solved(
        self, part: RunPart, ground: Sequence[Measurement], hands: Sequence[str]
    ) -> tuple[Estimate, Estimate, ModelSpread | None]:
        """Estimates some frames: with bands of noise alone, and with the bands given out."""
        sensors = [
            *ground,
            *body_sensors(self.tree, self._settings, hands, part.propped, part.unseen),
            *part.imus,
        ]
        found = self._estimate(self.tree, part.q, part, sensors, spreads=True)
        for text in found.assumed:
            if text not in self._assumed:
                self._assumed.append(text)
        if not self._draws:
            return found, found, None
        spread = self._spread(part, sensors)
        return found, widened(found, spread, part.time_s), spread

    def _estimate(
        self,
        tree: EstimationTree,
        q: Array,
        part: RunPart,
        sensors: Sequence[Measurement],
        *,
        spreads: bool,
    ) -> Estimate:
        return estimate(
            tree,
            q,
            part.v,
            part.a,
            sensors,
            method=self._settings.method,
            covariances=self._settings.covariances,
            spreads=spreads,
        )

    def _spread(self, part: RunPart, sensors: Sequence[Measurement]) -> ModelSpread:
        """Works out drawn models on a thinned grid that begins and ends with the frames."""
        errors = self._settings.model_errors
        assert errors is not None
        cell = np.floor((part.time_s - part.time_s[0]) / errors.grid_s)
        chosen = np.flatnonzero(np.r_[True, np.diff(cell) > 0])
        chosen = np.unique(np.r_[chosen, len(part.time_s) - 1])
        few = part.select(chosen)
        some = [of_frames(sensor, chosen, len(part.time_s)) for sensor in sensors]

        def means(
            tree: EstimationTree, posture: Array, measurements: Sequence[Measurement]
        ) -> Estimate:
            return self._estimate(tree, posture, few, measurements, spreads=False)

        return model_spread(self.tree, few.q, few.time_s, some, errors, self._draws, means)

    def _follow(
        self, found: Estimate, spread: ModelSpread | None, time_s: Array, bearing: Loads
    ) -> tuple[IntArray, Array]:
        """Follows the hands' state and weighs the holds that end here."""
        if not self._hands:
            return np.zeros(len(time_s), dtype=np.intp), np.zeros(len(time_s))
        sd = bearing.sd_kg if bearing.sd_kg is not None else np.zeros(len(time_s))
        state, chance = self._tracker.take(time_s, bearing.mass_kg, sd, bearing.known)
        if bearing.noise_covariance is not None:
            frames = hold_frames(found, spread, time_s, state, bearing)
            self._holds.extend(self._collector.take(frames))
        return state, chance

    def finish(self) -> RunSummary:
        """Closes the last hold and says what the run comes to.

        Raises:
            RunInputError: no frame was estimated.
        """
        if not self._frames:
            why = "; ".join(self._findings.texts()) or "none was added"
            raise RunInputError(f"expected at least one frame to estimate, got none: {why}")
        self._holds.extend(self._collector.close())
        for text in filter(None, map(hold_in_words, self._holds)):
            self._findings.note(text)
        gaps = np.concatenate(self._gaps)
        gap = None
        if len(gaps):
            low, middle, high = np.quantile(gaps, (0.05, 0.5, 0.95)).tolist()
            gap = (low, middle, high)
            self._weigh(middle, self.tree.mass_kg)
        names = [self.tree.joint_names[joint] for joint in self._turning]
        return RunSummary(
            dof_names=self.tree.dof_names,
            joint_names=tuple(names),
            definition=self._settings.definition,
            free_hands=self._hands or (),
            frames=self._frames,
            left_out=dict(self._left_out),
            holds=tuple(self._holds),
            bands=self._bands,
            body_mass_kg=self.tree.mass_kg,
            tare=self.tare,
            plates_minus_model_kg=gap,
            joint_known_share=dict(zip(names, (self._known / self._frames).tolist(), strict=True)),
            assumed=tuple(self._assumed),
            findings=self._findings.texts(),
        )

    def _weigh(self, gap_kg: float, body_kg: float) -> None:
        """Says so where the plates bear more or less than the body, beyond what may be a load."""
        text = mass_in_words(gap_kg, body_kg)
        if text and (gap_kg < 0.0 or not self._hands or self._frames == 0):
            self._findings.note(text)


def estimate_run(
    model: HumanModel,
    motion: Motion,
    feet: FootForces | None,
    settings: RunSettings | None = None,
    imus: Sequence[Measurement] = (),
) -> tuple[RunChunk, RunSummary]:
    """Estimates a recording that fits into memory: all its frames as one chunk, and the summary.

    Args:
        model: the person.
        motion: the recording.
        feet: the wrenches under the feet at its frames, or None.
        settings: how to estimate.
        imus: what else was measured at its frames.

    Raises:
        RunInputError: the parts do not fit together, or no frame could be estimated.
        MeasurementError: a measurement has another shape.
        CovarianceError: a covariance is not one.
    """
    run = RecordingRun(model, settings)
    chunks = list(run.add(motion, feet, imus))
    summary = run.finish()
    return RunChunk.joined(chunks), summary
