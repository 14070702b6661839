"""OpenSim's answer for `opencap_subject4`: run in its own environment, kept outside the tree."""

import hashlib
import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks.estimation.real_motion.reference import Array, Reference

_SCRIPT = Path(__file__).with_name("opensim_run.py")
#: OpenSim's ground (x forward, y up, z right) to z up, y left.
TO_HOUSE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
GRAVITY = np.array([0.0, 0.0, -9.81])
_JOINTS = {
    "hip_r": "jRightHip", "walker_knee_r": "jRightKnee", "ankle_r": "jRightAnkle",
    "hip_l": "jLeftHip", "walker_knee_l": "jLeftKnee", "ankle_l": "jLeftAnkle", "back": "jL5S1",
}  # fmt: skip
#: Coordinates whose axis is the hip line, so that their generalised force checks the moment.
_CHECKED = {"hip_r": "hip_flexion_r", "hip_l": "hip_flexion_l", "back": "lumbar_extension"}
_BALANCED = 0.1

HOW = (
    "OpenSim is not installed here. It needs an environment of its own:\n"
    "    python -m venv DIR && DIR/bin/pip install opensim\n"
    "and then --opensim DIR/bin/python (or ERGOCAST_OPENSIM=DIR/bin/python)."
)


def opensim_arrays(data: Path, trial: str, python: str | None) -> dict[str, Array]:
    """Returns what `opensim_run` leaves for a trial; run once, then taken from the cache.

    Args:
        data: the folder ``opencap_subject4``.
        trial: ``squats1`` and so on.
        python: a Python that has OpenSim; needed where nothing is cached yet.

    Raises:
        RuntimeError: OpenSim is needed and not there, or it failed.
    """
    digest = hashlib.sha256(_SCRIPT.read_bytes())
    for name in (f"{trial}.trc", f"{trial}_grf.mot", "optimized_scale_and_markers.osim"):
        digest.update((data / name).read_bytes())
    cache = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "ergocast"
    kept = cache / f"opensim_{trial}_{digest.hexdigest()[:16]}.npz"
    if not kept.is_file():
        python = python or os.environ.get("ERGOCAST_OPENSIM")
        if python is None:
            raise RuntimeError(HOW)
        cache.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "out.npz"
            ended = subprocess.run(
                [python, str(_SCRIPT), str(data.resolve()), trial, str(out)],
                cwd=folder, capture_output=True, text=True, check=False,
            )  # fmt: skip
            if ended.returncode != 0 or not out.is_file():
                raise RuntimeError(f"OpenSim failed on {trial}:\n{ended.stderr[-2000:]}\n{HOW}")
            kept.write_bytes(out.read_bytes())
    with np.load(kept) as stored:
        return {name: stored[name] for name in stored.files}


def joint_centres(arrays: dict[str, Array]) -> dict[str, Array]:
    """Returns the joint centres ``(frames, 3)`` in house axes, by the model's joint names."""
    return {
        _JOINTS[name]: arrays["center"][:, k] @ TO_HOUSE.T
        for k, name in enumerate(arrays["joint_names"].tolist())
    }


def bodies(arrays: dict[str, Array]) -> tuple[dict[str, Array], dict[str, Array]]:
    """Returns rotation ``(frames, 3, 3)`` and origin ``(frames, 3)`` by body, house axes.

    A body's own axes are turned alike: x forward, y left, z up where OpenSim's neutral pose has
    them parallel to the ground's.
    """
    names = arrays["body_names"].tolist()
    turn = TO_HOUSE @ arrays["turn"] @ TO_HOUSE.T
    place = arrays["place"] @ TO_HOUSE.T
    return ({n: turn[:, k] for k, n in enumerate(names)},
            {n: place[:, k] for k, n in enumerate(names)})  # fmt: skip


def reference(arrays: dict[str, Array], trial: str) -> Reference:
    """Returns the net joint moments of OpenSim's bodies.

    Generalised forces are moments along OpenSim's own axes; here the vectors are wanted. So Newton
    and Euler are written down for its bodies, as it moves them; where its axis is the hip line,
    its generalised force must be the vector's projection, which the notes state.
    """
    time_s = arrays["time"]
    mass, names = arrays["mass"], arrays["body_names"].tolist()
    turn = TO_HOUSE @ arrays["turn"] @ TO_HOUSE.T
    place = arrays["place"] @ TO_HOUSE.T
    com = arrays["com"] @ TO_HOUSE.T
    inertia = TO_HOUSE @ arrays["inertia"] @ TO_HOUSE.T
    force, moment, center_of_mass = _body_wrenches(time_s, turn, place, com, mass, inertia)
    plates = _plates(arrays, time_s)
    for k, body in enumerate(("calcn_r", "calcn_l")):
        at = names.index(body)
        # What the plate does to the foot, about its centre of mass.
        force[:, at] -= plates[:, k, :3]
        moment[:, at] -= plates[:, k, 3:] - np.cross(center_of_mass[:, at], plates[:, k, :3])
    residual = np.linalg.norm(force.sum(axis=1), axis=1)
    weight = 9.81 * float(mass.sum())
    centres = joint_centres(arrays)
    axis = centres["jLeftHip"] - centres["jRightHip"]
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    parent = arrays["parent"].tolist()
    moments: dict[str, Array] = {}
    notes = []
    for k, name in enumerate(arrays["joint_names"].tolist()):
        subtree = _subtree(parent, int(arrays["child"][k]))
        arm = center_of_mass[:, subtree] - centres[_JOINTS[name]][:, None]
        moments[_JOINTS[name]] = np.sum(
            moment[:, subtree] + np.cross(arm, force[:, subtree]), axis=1
        )
        if name in _CHECKED:
            theirs = np.interp(time_s, arrays["id_time"], arrays[f"id_{_CHECKED[name]}"])
            ours = np.sum(moments[_JOINTS[name]] * axis, axis=1)
            inner = slice(5, -5)
            # OpenSim's axis points to the right.
            error = np.sqrt(np.mean((ours + theirs)[inner] ** 2)) / mass.sum()
            notes.append(f"{_CHECKED[name]}: vectors and generalised force differ by {error:.4f}")
    balanced = residual < _BALANCED * weight
    notes.append(f"residual below a tenth of body weight on {np.mean(balanced):.0%} of frames")
    return Reference(
        program="OpenSim", trial=trial, mass_kg=float(mass.sum()), time_s=time_s,
        moment=moments, axis=dict.fromkeys(moments, axis), valid=dict.fromkeys(moments, balanced),
        notes=tuple(notes),
    )  # fmt: skip


def plate_wrenches(arrays: dict[str, Array]) -> Array:
    """Returns ``(frames, 2, 6)``: right and left foot, house axes about the origin, 6 Hz."""
    return _plates(arrays, arrays["time"])


def _plates(arrays: dict[str, Array], time_s: Array) -> Array:
    wrench = arrays["plate_wrench"].reshape(-1, 2, 2, 3) @ TO_HOUSE.T
    flat = wrench.reshape(len(wrench), -1)
    columns = [np.interp(time_s, arrays["plate_time"], column) for column in flat.T]
    return np.stack(columns, axis=1).reshape(-1, 2, 6)


def _body_wrenches(
    time_s: Array, turn: Array, place: Array, com: Array, mass: Array, inertia: Array
) -> tuple[Array, Array, Array]:
    """Returns what must act on each body: force, moment about its centre of mass, that centre."""
    center = place + np.einsum("tbij,bj->tbi", turn, com)
    acceleration = CubicSpline(time_s, center, axis=0)(time_s, 2)
    spline = CubicSpline(time_s, turn, axis=0)
    first, second = spline(time_s, 1), spline(time_s, 2)
    back = np.swapaxes(turn, -1, -2)
    omega = _vector(first @ back)
    alpha = _vector(second @ back + first @ np.swapaxes(first, -1, -2))
    world = turn @ inertia @ back
    force = mass[:, None] * (acceleration - GRAVITY)
    spin = np.einsum("tbij,tbj->tbi", world, omega)
    moment = np.einsum("tbij,tbj->tbi", world, alpha) + np.cross(omega, spin)
    return force, moment, center


def _vector(matrix: Array) -> Array:
    """The vector of the antisymmetric part."""
    odd = 0.5 * (matrix - np.swapaxes(matrix, -1, -2))
    return np.stack([odd[..., 2, 1], odd[..., 0, 2], odd[..., 1, 0]], axis=-1)


def _subtree(parent: list[int], root: int) -> list[int]:
    inside = {root}
    grown = True
    while grown:
        more = {k for k, above in enumerate(parent) if above in inside} - inside
        inside |= more
        grown = bool(more)
    return sorted(inside)
