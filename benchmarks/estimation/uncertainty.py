"""Whether bands hold: with the noise that is stated, with a wrong model, and for the payload.

Run ``python -m benchmarks.estimation.uncertainty``. Simulated people; truth by Pinocchio and the
model's own inverse dynamics. Prints each figure beside its bar, and returns 1 if one misses it.
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np

from benchmarks.estimation.carrying import FOOT_SD, Carrying
from benchmarks.estimation.moving_scene import Scene, moving_scene, noisy
from benchmarks.estimation.wrong_model import FEET, Strangers, strangers
from benchmarks.figure import Figure, shown
from estimation import (
    APPLICATION,
    Accelerometer,
    Estimate,
    EstimationTree,
    ForceTorque,
    FreeWrench,
    JointAcceleration,
    Measurement,
    ModelErrors,
    RunSettings,
    estimate,
    estimate_run,
    joint_efforts,
    payload,
    real_tree,
)
from estimation.model_uncertainty import draw_models, model_spread, widened
from estimation.run.run_sensors import PELVIS_LEVER_M
from estimation.spatial import skew, times
from estimation.tree_kinematics import tree_kinematics
from human import HumanModel, Subject, generate_model

#: The 2021 paper's covariances, for measurements that are exact.
PAPER = {Accelerometer: 1.1e-3, JointAcceleration: 6.66e-6, ForceTorque: 1e-6}


def main() -> int:
    """Prints one line a figure; returns 1 if one misses its bar."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--people", type=int, default=300, help="people drawn around the model")
    parser.add_argument("--runs", type=int, default=8, help="runs of each load, new noise each")
    options = parser.parse_args()
    model = generate_model(Subject(1.76, 74.3, "male"))
    return shown(
        chain(
            exact(model),
            stated_noise(model),
            carried(model, options.runs),
            turned(model),
            wrong_model(model, options.people),
        )
    )


def rms(x: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(x))))


def exact(model: HumanModel) -> Iterator[Figure]:
    """Exact measurements, believed as the paper believes them."""
    scene = moving_scene(model, 256, np.random.default_rng(0), beside=0.0)
    sensors = [
        sensor
        if isinstance(sensor, FreeWrench)
        else replace(sensor, covariance=PAPER[type(sensor)])
        for sensor in scene.sensors
    ]
    found = estimate(real_tree(model), scene.q, scene.v, scene.a, sensors)
    error = rms(found.torque - scene.torque)
    yield Figure("exact measurements: torque RMSE", error, "N m", most=0.02)
    off = float(np.max(np.abs(payload(found).mass_kg - scene.load_kg)))
    yield Figure("exact measurements: 5 kg, largest error of a frame", off, "kg", most=0.02)


def stated_noise(model: HumanModel) -> Iterator[Figure]:
    """The model right, and every sensor with the noise that is stated."""
    tree = real_tree(model)
    errors, inside, effort, kilograms, sds, floors = [], [], [], [], [], []
    preset = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        scene = moving_scene(model, 256, rng)
        sensors = noisy(scene, rng, tree)
        found = estimate(tree, scene.q, scene.v, scene.a, sensors)
        assert found.torque_sd is not None
        errors.append(found.torque - scene.torque)
        inside.append(np.abs(errors[-1]) < 1.96 * found.torque_sd)
        effort.append(efforts_inside(tree, scene, found))
        held = payload(found)
        kilograms.append(held.mass_kg - scene.load_kg)
        assert held.sd_kg is not None
        sds.append(held.sd_kg)
        floors.append(frame_floor(tree, scene, found))
        paper = estimate(
            tree,
            scene.q,
            scene.v,
            scene.a,
            noisy(scene, rng),
            method="two_step",
            preset=APPLICATION,
        )
        assert paper.torque_sd is not None
        preset.append(np.abs(paper.torque - scene.torque) < 1.96 * paper.torque_sd)
    yield Figure("noise stated: torque RMSE", rms(np.array(errors)), "N m", most=0.35)
    cover = np.mean(np.concatenate(inside), axis=0)
    yield Figure("noise stated: 95 % of torques", float(np.mean(cover)), "", 0.92, 0.97)
    yield Figure("  the least covered degree of freedom", float(np.min(cover)), "", 0.92, 0.97)
    yield Figure("  the most covered", float(np.max(cover)), "", 0.92, 0.97)
    yield Figure("noise stated: 90 % of efforts", float(np.mean(effort)), "", 0.87, 0.93)
    yield Figure(
        "the paper's preset, two steps: 95 % of torques",
        float(np.mean(preset)),
        beside="labelled 'tuning'",
    )
    z = np.concatenate(kilograms) / np.concatenate(sds)
    cover_kg = float(np.mean(np.abs(z) < 1.96))
    yield Figure("noise stated: 95 % of payloads of a frame", cover_kg, "", 0.92, 0.97)
    yield Figure(
        "  their standard deviation, 5 kg in motion",
        float(np.std(np.concatenate(kilograms))),
        "kg",
        beside=f"stated {rms(np.concatenate(sds)):.3f}; Cramer-Rao floor of the feet's noise alone "
        f"{np.mean(floors):.3f}",
    )


def frame_floor(tree: EstimationTree, scene: Scene, found: Estimate) -> float:
    """Least standard deviation of one frame's mass, kg, from the noise of the feet alone.

    Derived here: feet and balance say the force ``F`` at the hand and the moment about it, with the
    feet's noise carried there; the load's moment is known to 0.1 N m, so that of the feet's noise
    tells of the force's. With ``F = -m a`` and ``V`` what is left of the force's covariance, the
    Cramer-Rao bound of ``m`` is ``1 / (a'V^-1 a)``; all else is taken to be exact.
    """
    kinematics = tree_kinematics(tree, scene.q, scene.v)
    hand = found.link("RightHandCOM")
    whole = np.zeros((len(scene.q), 6, 6))
    whole[:, 3:, 3:] = 0.1**2 * np.eye(3)
    for name in FEET:
        foot = found.link(name)
        carry = np.tile(np.eye(6), (len(scene.q), 1, 1))
        carry[:, 3:, :3] = skew(kinematics.position[foot] - kinematics.position[hand])
        whole += carry @ np.diag(FOOT_SD**2) @ carry.swapaxes(-1, -2)
    cross = whole[:, :3, 3:]
    left = whole[:, :3, :3] - cross @ np.linalg.solve(whole[:, 3:, 3:], cross.swapaxes(-1, -2))
    pull = times(found.link_rotation[:, hand], found.link_acceleration[:, hand, :3])
    told = np.einsum("ni,nij,nj->n", pull, np.linalg.inv(left), pull)
    return float(np.sqrt(np.mean(1.0 / told)))


def efforts_inside(tree: EstimationTree, scene: Scene, found: Estimate) -> float:
    """Share of true efforts between their 5 % and 95 % quantiles, of joints with three axes.

    Derived here: a joint's torques are ``H'm`` with ``H`` its axes, so its moment is ``H^-T tau``.
    """
    efforts = joint_efforts(found)
    assert efforts.quantiles_nm is not None
    kinematics, shares = tree_kinematics(tree, scene.q, scene.v), []
    for column, name in enumerate(efforts.joint_names):
        link = tree.joint_names.index(name) + 1
        if len(tree.dofs[link]) == 3:
            axes = kinematics.H[link][:, 3:].swapaxes(-1, -2)
            moment = np.linalg.solve(axes, scene.torque[:, tree.dofs[link], None])[..., 0]
            true = np.linalg.norm(moment, axis=1)
            low, high = efforts.quantiles_nm[:, column, 0], efforts.quantiles_nm[:, column, 2]
            shares.append(np.mean((low < true) & (true < high)))
    return float(np.mean(shares))


def carried(model: HumanModel, runs: int) -> Iterator[Figure]:
    """Loads of whole holds, through a run."""
    noise = RunSettings(model_errors=None)
    one = Carrying.of(model, 5.0, "right")
    settings = replace(noise, free_hands="right", hand_force_sd_n=100.0, hand_moment_sd_nm=0.1)
    found = [
        one.weighed(settings, np.random.default_rng(seed), suit=True)[0].mass()
        for seed in range(runs)
    ]
    error = rms(np.array([mass.mass_kg - 5.0 for mass in found]))
    yield Figure("5 kg lifted and carried, hold: error, rms over runs", error, "kg", most=0.06)
    sd = float(np.mean([mass.sd_kg for mass in found if mass.sd_kg is not None]))
    yield Figure("  its stated standard deviation", sd, "kg", most=0.06)
    two = Carrying.of(model, 9.55, "both")
    for name, suit in (("17 accelerometers", True), ("derived accelerations", False)):
        sums = [
            two.weighed(noise, np.random.default_rng(seed), suit=suit)[0].mass().mass_kg
            for seed in range(runs)
        ]
        off = float(np.max(np.abs(np.array(sums) - 9.55)))
        yield Figure(f"9.55 kg in two hands, hold, {name}: largest error", off, "kg", most=0.3)
    hold, summary = two.weighed(RunSettings(), np.random.default_rng(0), suit=False)
    sd = hold.mass().sd_kg or 0.0
    yield Figure(
        "  the same, body not weighed: stated sd", sd, "kg", beside=f"bands: {summary.bands}"
    )
    motion = two.simulated.motion
    end = float(motion.time_s[np.argmax(sum(two.simulated.truth.load_kg.values()) > 0.0)])
    settings = RunSettings(tare_s=(0.0, end - 0.2))
    hold, summary = two.weighed(settings, np.random.default_rng(0), suit=False)
    sd = hold.mass().sd_kg or 0.0
    yield Figure("  weighed before the lift: stated sd", sd, "kg", beside=f"bands: {summary.bands}")
    off = abs(hold.mass().mass_kg - 9.55)
    yield Figure("  weighed before the lift: error", off, "kg", most=0.3)


def turned(model: HumanModel) -> Iterator[Figure]:
    """The same recording in a room that faces elsewhere."""
    scene = Carrying.of(model, 5.0, "right")
    feet = scene.feet(np.random.default_rng(0))
    moved, moved_feet = scene.turned(feet, 2.1)
    one, _ = estimate_run(model, scene.simulated.motion, feet, RunSettings(model_errors=None))
    two, _ = estimate_run(model, moved, moved_feet, RunSettings(model_errors=None))
    names = ("torque_nm", "effort_nm", "payload_kg", "low_back_force_n", "low_back_moment_nm")
    off = max(float(np.max(np.abs(getattr(one, n) - getattr(two, n)))) for n in names)
    yield Figure("whole scene turned about z: largest change", off, "SI", most=1e-9)


def wrong_model(model: HumanModel, people: int) -> Iterator[Figure]:
    """Masses, lengths, angles and plates wrong, drawn once a person."""
    for weighed, seen in ((False, False), (True, False), (True, True)):
        errors, rng = ModelErrors(feet_seen=seen), np.random.default_rng(1)
        scene = strangers(model, people, errors, rng, weighed=weighed)
        who = ("weighed" if weighed else "not weighed") + (", feet seen" if seen else "")
        plain, loose = [estimates(model, scene, slack=slack) for slack in (False, True)]
        wide = widen(model, scene, loose, errors, rng, weighed=weighed)
        for name, found, bar in (
            ("noise alone", plain, (None, None)),
            ("noise alone, moments left to the pelvis", loose, (None, None)),
            ("widened", wide, (0.92, 0.995)),
        ):
            error = found.torque - scene.torque
            assert found.torque_sd is not None
            cover = np.mean(np.abs(error) < 1.96 * found.torque_sd, axis=0)
            title = f"wrong model, {who}, {name}"
            missed = f"torque RMSE {rms(error):.2f} N m; labelled {found.bands!r}"
            yield Figure(f"{title}: 95 % of torques", float(np.mean(cover)), "", *bar, missed)
            if found is wide:
                yield Figure("  the least covered degree of freedom", float(np.min(cover)))
            held = payload(found)
            off = held.mass_kg - scene.load_kg
            assert held.sd_kg is not None
            kg = float(np.mean(np.abs(off) < 1.96 * held.sd_kg))
            text = f"rms error {rms(off):.2f} kg, stated {rms(held.sd_kg):.2f} kg"
            yield Figure("  95 % of payloads of a frame", kg, "", bar[0], beside=text)


def sensors_of(model: HumanModel, scene: Strangers, *, slack: bool) -> list[Measurement]:
    """The scene's sensors, and what a run adds where errors of the model are stated."""
    if not slack:
        return list(scene.sensors)
    moment = PELVIS_LEVER_M * model.total_mass_kg * 9.81
    sd = np.array([0.01] * 3 + [moment] * 3)
    return [*scene.sensors, ForceTorque("Pelvis", np.zeros((len(scene.q), 6)), sd**2)]


def estimates(model: HumanModel, scene: Strangers, *, slack: bool) -> Estimate:
    """Estimates everybody with the one model."""
    sensors = sensors_of(model, scene, slack=slack)
    return estimate(real_tree(model), scene.q, scene.v, scene.a, sensors)


def widen(
    model: HumanModel,
    scene: Strangers,
    found: Estimate,
    errors: ModelErrors,
    rng: np.random.Generator,
    *,
    weighed: bool,
) -> Estimate:
    """Widens bands by other draws than those that made the people."""
    tree = real_tree(model)
    sd = 0.0 if weighed else None
    draws = draw_models(tree, errors, rng, plates=FEET, body_mass_sd_kg=sd)

    def means(drawn: EstimationTree, q: np.ndarray, sensors: Sequence[Measurement]) -> Estimate:
        return estimate(drawn, q, scene.v, scene.a, sensors, spreads=False)

    time_s = np.arange(float(len(scene.q)))
    sensors = sensors_of(model, scene, slack=True)
    spread = model_spread(tree, scene.q, time_s, sensors, errors, draws, means)
    return widened(found, spread, time_s)


if __name__ == "__main__":
    raise SystemExit(main())
