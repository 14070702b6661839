"""Operator model files: safetensors with a JSON header, never pickle.

Layout: one safetensors file. Tensors are named ``<method>/<task>/<part>/<array>``, plus
``reduction``, ``familiarity``, ``skeleton`` and ``samples`` parts (the last is the motion that was
trained on); the metadata entry ``ergocast`` is a JSON object with everything that is not an array.
Loading never executes anything from the file.
"""

import json
import math
import os
import struct
import tempfile
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load as load_tensors
from safetensors.numpy import save as save_tensors

from human import HumanError, Subject
from prediction.chain import TASKS, JointReduction, Task
from prediction.errors import ModelFileError, PredictionError
from prediction.following.familiarity import Familiarity
from prediction.following.posture_band import PostureBand
from prediction.laws.hand_scatter import checked_sigma_x
from prediction.laws.memory import NullSpaceMemory
from prediction.laws.methods import method_class
from prediction.laws.predictor import Predictor
from prediction.operator_model import FittedMethod, OperatorModel, Skeleton
from prediction.training.kept_samples import KeptSamples, KeptTake

Array = NDArray[np.float64]

FORMAT = "ergocast-operator-model"
VERSION = 3
#: Largest file read, bytes; a trained model is a few megabytes.
MAX_BYTES = 256 * 2**20
_ENTRY = "ergocast"
_UNITS = {"angle": "rad", "length": "m", "time": "s", "mass": "kg"}


def model_bytes(model: OperatorModel) -> bytes:
    """Returns a model as the bytes of a model file; equal models give equal bytes."""
    tensors: dict[str, Array] = {
        "reduction/kept": model.reduction.kept.astype(np.float64),
        "reduction/expansion": model.reduction.expansion,
        "familiarity/centres": model.familiarity.centres,
        "demonstrated": model.demonstrated,
    }
    if model.sigma_x is not None:
        tensors["sigma_x"] = model.sigma_x
    methods = []
    for (name, task), fitted in model.methods.items():
        arrays, values = fitted.predictor.to_arrays()
        for key, array in arrays.items():
            tensors[f"{name}/{task}/predictor/{key}"] = array
        tensors[f"{name}/{task}/band/factor"] = fitted.band.factor
        tensors[f"{name}/{task}/band/rate_moment"] = fitted.band.rate_moment
        methods.append(
            {
                "name": name,
                "task": task,
                "values": values,
                "band_length": fitted.band.length,
                "band_clock": fitted.band.clock,
                "memory": None if fitted.memory is None else asdict(fitted.memory),
                "metrics": dict(fitted.metrics),
            }
        )
    header: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "units": _UNITS,
        "joint_names": list(model.joint_names),
        "dropped_joints": {n: model.reduction.coupling(n) for n in model.reduction.dropped_names},
        "method": model.method,
        "methods": methods,
        "familiarity": {
            "weight": model.familiarity.weight,
            "variance": model.familiarity.variance,
            "level": model.familiarity.level,
        },
        "linear_rows": model.linear_rows,
        "seed": model.seed,
        "data_digest": model.data_digest,
        "metrics": model.metrics,
        "training": model.training,
        "skeleton": None,
        "takes": None,
    }
    if model.samples is not None:
        tensors["samples/q"] = model.samples.q
        tensors["samples/qdot"] = model.samples.qdot
        tensors["samples/time_s"] = model.samples.time_s
        header["takes"] = [asdict(take) for take in model.samples.takes]
    if model.skeleton is not None:
        subject = model.skeleton.subject
        tensors["skeleton/offsets"] = model.skeleton.offsets
        header["skeleton"] = {
            "subject": {
                "height_m": subject.height_m,
                "mass_kg": subject.mass_kg,
                "sex": subject.sex,
            },
            "joint_names": list(model.skeleton.joint_names),
            "led": list(model.skeleton.led),
            "base": model.skeleton.base,
            "held": list(model.skeleton.held),
        }
    text = json.dumps(header, sort_keys=True, allow_nan=False, default=_plain)
    contiguous = {k: np.ascontiguousarray(v, dtype=np.float64) for k, v in tensors.items()}
    return bytes(save_tensors(contiguous, metadata={_ENTRY: text}))


def save_model(path: str | Path, model: OperatorModel) -> None:
    """Writes a model file; the file appears whole or not at all.

    Args:
        path: Where to; an existing file is replaced.
        model: The model.

    Raises:
        ModelFileError: The folder cannot be written to.
    """
    target = Path(path)
    data = model_bytes(model)
    try:
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    except OSError as error:
        raise ModelFileError(target, f"cannot write there: {error.strerror}") from error
    try:
        with os.fdopen(handle, "wb") as out:
            out.write(data)
            out.flush()
            os.fsync(out.fileno())
        Path(name).chmod(0o644)
        os.replace(name, target)
    except OSError as error:
        Path(name).unlink(missing_ok=True)
        raise ModelFileError(target, f"cannot be written: {error.strerror}") from error


def load_model(path: str | Path) -> OperatorModel:
    """Reads a model file.

    Args:
        path: The file.

    Returns:
        The model; its predictions are bit for bit those of the model that was saved.

    Raises:
        ModelFileError: The file is missing, damaged, of another kind or version, or holds values no
            operator has.
    """
    source = Path(path)
    try:
        if source.stat().st_size > MAX_BYTES:
            raise ModelFileError(
                source, f"is larger than {MAX_BYTES // 2**20} MiB: not a model file"
            )
        data = source.read_bytes()
    except OSError as error:
        raise ModelFileError(source, f"cannot be read: {error.strerror}") from error
    return model_from_bytes(data, source)


def model_from_bytes(data: bytes, name: str | Path = "model") -> OperatorModel:
    """Reads the bytes of a model file; see `load_model`.

    Args:
        data: The bytes.
        name: What to call them in an error.

    Returns:
        The model.

    Raises:
        ModelFileError: See `load_model`.
    """
    header = _header(data, name)
    if header.get("format") != FORMAT:
        raise ModelFileError(name, f"is not an operator model (format {header.get('format')!r})")
    if header.get("version") != VERSION:
        raise ModelFileError(
            name,
            f"is of version {header.get('version')!r}; this program reads version {VERSION}: train "
            "the operator again, or use the program that wrote it",
        )
    try:
        tensors = {key: np.array(value) for key, value in load_tensors(data).items()}
    except (SafetensorError, ValueError, KeyError, TypeError) as error:
        raise ModelFileError(name, f"is damaged: {error}") from error
    for key, value in tensors.items():
        if value.dtype != np.float64 or not np.isfinite(value).all():
            raise ModelFileError(name, f"holds numbers that are not finite float64 in {key!r}")
        value.flags.writeable = False
    try:
        return _assemble(header, tensors)
    except (KeyError, TypeError, ValueError, IndexError, HumanError, PredictionError) as error:
        what = f"missing {error}" if isinstance(error, KeyError) else str(error)
        raise ModelFileError(name, f"is damaged: {what}") from error


def _header(data: bytes, name: str | Path) -> dict[str, Any]:
    if len(data) < 8:
        raise ModelFileError(name, f"is too short ({len(data)} bytes): not a model file")
    (size,) = struct.unpack("<Q", data[:8])
    if size > len(data) - 8:
        raise ModelFileError(name, "is truncated, or not a safetensors file")
    try:
        outer = json.loads(data[8 : 8 + size])
        header = json.loads(outer["__metadata__"][_ENTRY])
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise ModelFileError(name, "has no readable model header") from error
    if not isinstance(header, dict):
        raise ModelFileError(name, "has no readable model header")
    return header


def _assemble(header: Mapping[str, Any], tensors: Mapping[str, Array]) -> OperatorModel:
    if header["units"] != _UNITS:
        raise ValueError(f"units {header['units']!r}, expected {_UNITS!r}")
    for field in ("metrics", "training"):
        if not isinstance(header[field], dict):
            raise ValueError(f"{field} is {header[field]!r}, expected an object")
    names = tuple(str(n) for n in header["joint_names"])
    kept = tensors["reduction/kept"].astype(np.int64)
    expansion = tensors["reduction/expansion"]
    _shape("reduction/expansion", expansion, (len(names), len(kept)))
    if len(set(kept.tolist())) != len(kept) or not ((kept >= 0) & (kept < len(names))).all():
        raise ValueError(f"learned joints {kept.tolist()} of {len(names)}")
    methods: dict[tuple[str, Task], FittedMethod] = {}
    for entry in header["methods"]:
        task = entry["task"]
        if task not in TASKS:
            raise ValueError(f"task {task!r}")
        prefix = f"{entry['name']}/{task}/"
        part = {
            key.removeprefix(prefix + "predictor/"): value
            for key, value in tensors.items()
            if key.startswith(prefix + "predictor/")
        }
        predictor = method_class(entry["name"]).from_arrays(part, entry["values"])
        _try_out(predictor, len(kept))
        factor = tensors[prefix + "band/factor"]
        moment = tensors[prefix + "band/rate_moment"]
        _shape("band/factor", factor, (len(kept), len(kept)))
        _shape("band/rate_moment", moment, (len(kept), len(kept)))
        clock = float(entry.get("band_clock", 0.0))
        if not 0.0 <= clock <= 1.0:
            raise ValueError(f"band_clock {clock}")
        band = PostureBand(factor, _positive(entry["band_length"]), moment, clock)
        memory = entry.get("memory")
        memory = None if memory is None else NullSpaceMemory(**memory)
        methods[entry["name"], task] = FittedMethod(predictor, band, entry["metrics"], memory)
    if not any(name == header["method"] for name, _ in methods):
        raise ValueError(f"chosen method {header['method']!r} is not in the file")
    cover = header["familiarity"]
    _shape("familiarity", tensors["familiarity/centres"], (None, len(kept)))
    _shape("demonstrated", tensors["demonstrated"], (2, len(names)))
    skeleton = None
    if header["skeleton"] is not None:
        body = header["skeleton"]
        joints = tuple(str(n) for n in body["joint_names"])
        _shape("skeleton/offsets", tensors["skeleton/offsets"], (len(joints), 3))
        skeleton = Skeleton(
            Subject(**body["subject"]),
            joints,
            tensors["skeleton/offsets"],
            tuple(str(tip) for tip in body["led"]),
            str(body["base"]),
            tuple(str(tip) for tip in body["held"]),
        )
    model = OperatorModel(
        methods=methods,
        method=header["method"],
        reduction=JointReduction(names, kept, expansion),
        familiarity=Familiarity(
            tensors["familiarity/centres"],
            _positive(cover["weight"]),
            _positive(cover["variance"]),
            _positive(cover["level"]),
        ),
        demonstrated=tensors["demonstrated"],
        sigma_x=_sigma_x(tensors),
        skeleton=skeleton,
        linear_rows=int(header["linear_rows"]),
        seed=int(header["seed"]),
        data_digest=str(header["data_digest"]),
        metrics=header["metrics"],
        training=header["training"],
        samples=_samples(header, tensors, len(names)),
    )
    if skeleton is not None and model.chain.dof_names != names:
        raise ValueError("its joints are not those of its skeleton")
    return model


def _samples(
    header: Mapping[str, Any], tensors: Mapping[str, Array], joints: int
) -> KeptSamples | None:
    if header["takes"] is None:
        return None
    takes = tuple(KeptTake(**take) for take in header["takes"])
    count = sum(take.samples for take in takes)
    _shape("samples/q", tensors["samples/q"], (count, joints))
    _shape("samples/qdot", tensors["samples/qdot"], (count, joints))
    _shape("samples/time_s", tensors["samples/time_s"], (count,))
    return KeptSamples(
        tensors["samples/q"], tensors["samples/qdot"], tensors["samples/time_s"], takes
    )


def _try_out(predictor: Predictor, joints: int) -> None:
    """Makes one prediction, so that arrays that do not fit together are found here."""
    rows, null = predictor.basis.rows, predictor.basis.null
    _shape("null", null, (joints, None))
    _shape("rows", rows, (joints - null.shape[1], joints))
    frame = np.concatenate([rows, null.T])
    if np.abs(frame @ frame.T - np.eye(joints)).max() > 1e-8:
        raise ValueError("the null-space axes are not orthonormal")
    answer = predictor.predict(np.zeros(joints), np.zeros(len(rows)), rows)
    _shape("mean", answer.mean, (joints,))
    _shape("null_factor", answer.null_factor, (joints, None))
    if not (np.isfinite(answer.mean).all() and np.isfinite(answer.null_factor).all()):
        raise ValueError("its prediction is not finite")


def _sigma_x(tensors: Mapping[str, Array]) -> Array | None:
    if "sigma_x" not in tensors:
        return None
    return checked_sigma_x(tensors["sigma_x"], len(tensors["sigma_x"]))


def _shape(name: str, array: Array, shape: tuple[int | None, ...]) -> None:
    fits = array.ndim == len(shape) and all(
        wanted is None or got == wanted for got, wanted in zip(array.shape, shape, strict=True)
    )
    if not fits:
        raise ValueError(f"{name} has shape {array.shape}, expected {shape}")


def _positive(value: Any) -> float:
    number = float(value)
    if not math.isfinite(number) or number <= 0:
        raise ValueError(f"{value!r} is not a positive number")
    return number


def _plain(value: object) -> object:
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"cannot write {type(value).__name__} as JSON")
