"""Training, comparing, keeping and reading back an operator model."""

import json
import struct
from dataclasses import replace

import numpy as np
import pytest
from planar import PlanarChain, planar_demonstrations
from safetensors.numpy import load as load_tensors
from safetensors.numpy import save as save_tensors

from human import Chain, Subject, generate_model, scale_model
from prediction import (
    ModelFileError,
    PredictionError,
    Skeleton,
    TrainingCancelledError,
    TrainingOptions,
    UnsupportedMethodError,
    compare_methods,
    demonstrations_from_samples,
    load_model,
    model_bytes,
    model_from_bytes,
    save_model,
    scores_to_dict,
    split_in_time,
    train_operator,
)

FAST = TrainingOptions(method="mi-nsgp", optimizer="gradient", tasks=("position",), blocks=3)


@pytest.fixture(scope="module")
def trained():
    chain = PlanarChain()
    demonstrations = planar_demonstrations(seed=3, samples=300)[1]
    model, scores = compare_methods(
        chain, demonstrations, seed=1, options=FAST, task="position", samples=40
    )
    return chain, demonstrations, replace(model, metrics=scores_to_dict(scores)), scores


def a_path(chain, points=20):
    q0 = np.deg2rad([80.0, -30.0, -20.0, -50.0, -30.0])
    start = chain.arm.forward(q0)
    time_s = 0.04 * np.arange(points)
    return time_s, start + 0.1 * np.stack([np.sin(time_s), 0 * time_s], axis=1), q0


def roll(model, chain, **options):
    time_s, position, q0 = a_path(chain)
    return model.rollout(
        position, None, time_s, q0, 5, np.random.default_rng(0), chain=chain, **options
    )


def test_all_methods_are_trained_and_scored_beside_the_chosen_one(trained):
    _, _, model, scores = trained
    assert model.method_names == ("mi-nsgp", "cov-ik", "minimum-norm")
    assert [s.method for s in scores] == list(model.method_names)
    by_name = {s.method: s for s in scores}
    assert by_name["mi-nsgp"].log_likelihood > by_name["minimum-norm"].log_likelihood
    for score in scores:
        assert score.hand_error_m_s < 1e-10
        assert score.rollout_hand_mean_m < 2e-4
        assert 0.5 < score.coverage90_rollout <= 1.0
        assert score.rollout_rmse_deg > 0
    json.dumps(scores_to_dict(scores), allow_nan=False)


def test_calibration_repairs_the_one_step_coverage(trained):
    _, _, model, _ = trained
    metrics = model.fitted("cov-ik", "position").metrics
    before, after = (metrics[f"coverage90_one_step_{k}"] for k in ("before", "after"))
    assert abs(after - 0.9) < abs(before - 0.9) + 0.03
    assert metrics["variance_factor"] > 0


def test_same_seed_same_bytes(trained):
    chain, demonstrations, _, _ = trained
    few = demonstrations.take(slice(0, 80))
    one, two = (model_bytes(train_operator(chain, few, seed=4, options=FAST)) for _ in range(2))
    assert one == two


def test_training_reports_and_can_be_stopped(trained):
    chain, demonstrations, _, _ = trained
    few = demonstrations.take(slice(0, 120))
    told = []
    train_operator(chain, few, seed=1, options=FAST, progress=lambda *a: told.append(a))
    shares = [share for _, share, _ in told]
    assert shares == sorted(shares) and shares[-1] == 1.0
    assert np.isfinite([likelihood for *_, likelihood in told]).all()
    calls = []

    def stop() -> bool:
        calls.append(1)
        return len(calls) > 3

    with pytest.raises(TrainingCancelledError):
        train_operator(chain, few, seed=1, options=FAST, should_stop=stop)


def test_the_fewest_demonstrations_accepted_can_be_trained_on(trained):
    chain, demonstrations, _, _ = trained
    model = train_operator(chain, demonstrations.take(slice(0, 20)), seed=0, options=FAST)
    assert np.isfinite(roll(model, chain).q).all()
    with pytest.raises(PredictionError, match="at least 20"):
        train_operator(chain, demonstrations.take(slice(0, 19)), seed=0, options=FAST)


def test_unknown_methods_and_tasks_are_refused(trained):
    model = trained[2]
    with pytest.raises(UnsupportedMethodError, match="cov-ik"):
        TrainingOptions(method="oracle")
    with pytest.raises(UnsupportedMethodError, match="position"):
        TrainingOptions(tasks=("dance",))
    with pytest.raises(UnsupportedMethodError, match="pose"):
        model.fitted("cov-ik", "pose")
    with pytest.raises(PredictionError, match="skeleton"):
        model.chain  # noqa: B018


def test_split_is_in_time(trained):
    _, demonstrations, _, _ = trained
    first, rest = split_in_time(demonstrations, 0.7)
    assert len(first) == 210 and len(rest) == 90
    np.testing.assert_array_equal(np.concatenate([first.q, rest.q]), demonstrations.q)
    with pytest.raises(PredictionError, match="too short"):
        split_in_time(demonstrations.take(slice(0, 1)))


def test_file_round_trip_predicts_bit_for_bit(trained, tmp_path):
    chain, _, model, _ = trained
    path = tmp_path / "operator.safetensors"
    save_model(path, model)
    again = load_model(path)
    assert model_bytes(again) == path.read_bytes()
    for method in model.method_names:
        for noise in ("coherent", "white"):
            a, b = (roll(m, chain, method=method, noise=noise) for m in (model, again))
            np.testing.assert_array_equal(a.q, b.q)
            np.testing.assert_array_equal(a.familiarity, b.familiarity)
    assert again.metrics == json.loads(json.dumps(dict(model.metrics)))
    assert again.data_digest == model.data_digest and len(model.data_digest) == 64
    assert again.seed == 1 and again.joint_names == model.joint_names


def test_writing_is_whole_or_not_at_all(trained, tmp_path, monkeypatch):
    _, _, model, _ = trained
    path = tmp_path / "operator.safetensors"
    path.write_bytes(b"old")

    def fail(*_: object) -> None:
        raise OSError(28, "no space left")

    monkeypatch.setattr("prediction.model_file.os.replace", fail)
    with pytest.raises(ModelFileError, match="no space"):
        save_model(path, model)
    assert path.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["operator.safetensors"]
    with pytest.raises(ModelFileError):
        save_model(tmp_path / "nowhere" / "x", model)


def rewritten(data: bytes, change_header=None, change_tensors=None) -> bytes:
    (size,) = struct.unpack("<Q", data[:8])
    header = json.loads(json.loads(data[8 : 8 + size])["__metadata__"]["ergocast"])
    tensors = load_tensors(data)
    if change_header:
        change_header(header)
    if change_tensors:
        change_tensors(tensors)
    return save_tensors(tensors, metadata={"ergocast": json.dumps(header)})


def set_key(key, value):
    return lambda d: d.update({key: value})


def drop(key):
    return lambda d: d.pop(key)


HOSTILE = {
    "empty": (lambda d: b"", "too short"),
    "not a model": (lambda d: b"hello world, this is text" * 10, "truncated|header"),
    "pickle": (lambda d: b"\x80\x04\x95" + d, "truncated|header"),
    "cut in the header": (lambda d: d[:100], "truncated"),
    "cut in the data": (lambda d: d[:-8], "damaged"),
    "huge header": (lambda d: struct.pack("<Q", 2**62) + d[8:], "truncated"),
    "plain safetensors": (lambda d: save_tensors({"a": np.zeros(2)}), "header"),
    "another version": (lambda d: rewritten(d, set_key("version", 99)), "version 99"),
    "another format": (lambda d: rewritten(d, set_key("format", "x")), "not an operator model"),
    "unknown method": (
        lambda d: rewritten(d, lambda h: h["methods"][0].update(name="os.system")),
        "os.system",
    ),
    "chosen method missing": (lambda d: rewritten(d, set_key("method", "x")), "chosen"),
    "other units": (lambda d: rewritten(d, set_key("units", {"angle": "deg"})), "units"),
    "metrics of another shape": (lambda d: rewritten(d, set_key("metrics", None)), "metrics"),
    "training of another shape": (lambda d: rewritten(d, set_key("training", [1])), "training"),
    "no joints": (lambda d: rewritten(d, drop("joint_names")), "joint_names"),
    "joint missing": (lambda d: rewritten(d, set_key("joint_names", ["a"])), "shape"),
    "nan": (
        lambda d: rewritten(d, None, lambda t: t.update(demonstrated=t["demonstrated"] * np.nan)),
        "finite",
    ),
    "tensor missing": (lambda d: rewritten(d, None, drop("familiarity/centres")), "familiarity"),
    "array that does not fit": (
        lambda d: rewritten(
            d,
            None,
            lambda t: t.update({"mi-nsgp/position/predictor/mean_weights": np.zeros((2, 2))}),
        ),
        "damaged",
    ),
    "axes that are none": (
        lambda d: rewritten(
            d, None, lambda t: t.update({"cov-ik/position/predictor/null": np.zeros((5, 3))})
        ),
        "orthonormal",
    ),
    "negative length": (
        lambda d: rewritten(d, lambda h: h["methods"][0].update(band_length=-1)),
        "positive",
    ),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_damaged_and_hostile_files_are_refused(trained, tmp_path, case):
    spoil, words = HOSTILE[case]
    path = tmp_path / "bad.safetensors"
    path.write_bytes(spoil(model_bytes(trained[2])))
    with pytest.raises(ModelFileError, match=words) as caught:
        load_model(path)
    assert caught.value.path == str(path)
    with pytest.raises(ModelFileError, match="cannot be read"):
        load_model(tmp_path / "missing")


@pytest.fixture(scope="module")
def person():
    """A model with measured offsets, and motion of its right arm chain."""
    base = generate_model(Subject(1.75, 72.0, "female"))
    offsets = {
        name: offset * 1.02 for name, offset in zip(base.joint_names, base.offsets, strict=True)
    }
    chain = Chain(scale_model(Subject(1.75, 72.0, "female"), offsets))
    rng = np.random.default_rng(0)
    time_s = np.arange(100) / 30
    rate, phase = rng.uniform(0.5, 2.5, (2, 30))
    swing = rng.normal(0, 0.04, (30, chain.n))
    middle = np.clip(0.3, chain.lower + 0.2, chain.upper - 0.2)
    q = middle + np.sin(time_s[:, None] * rate + 6 * phase) @ swing
    qdot = (rate * np.cos(time_s[:, None] * rate + 6 * phase)) @ swing
    demonstrations = demonstrations_from_samples(chain, q, qdot, time_s)
    options = TrainingOptions(method="minimum-norm", blocks=2)
    return chain, demonstrations, train_operator(chain, demonstrations, seed=0, options=options)


def test_a_persons_skeleton_comes_back_exactly(person):
    chain, demonstrations, model = person
    again = model_from_bytes(model_bytes(model))
    assert again.chain.dof_names == chain.dof_names
    assert again.human_model.subject == chain.model.subject
    here, there = (c.forward_and_jacobian(demonstrations.q[:5]) for c in (chain, again.chain))
    for a, b in zip(here, there, strict=True):
        np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(again.human_model.masses, chain.model.masses)


def test_a_person_is_followed_by_pose_and_by_position(person):
    chain, demonstrations, model = person
    part = demonstrations.take(slice(0, 20))
    position, rotation, _ = chain.forward_and_jacobian(part.q)
    for turned in (rotation, None):
        rollout = model.rollout(
            position, turned, part.time_s, part.q[0], 4, np.random.default_rng(0), sigma_x=0.0
        )
        there, facing, _ = chain.forward_and_jacobian(rollout.q)
        assert np.linalg.norm(there - position, axis=-1).max() < 2e-4
        off = np.abs(facing - rotation).max()
        assert (off < 2e-3) == (turned is not None)


def test_a_model_whose_joints_are_not_its_skeletons_is_refused(person):
    data = rewritten(model_bytes(person[2]), lambda h: h["skeleton"].update(led=["LeftHandCOM"]))
    with pytest.raises(ModelFileError, match="skeleton"):
        model_from_bytes(data)


def test_a_skeleton_needs_a_subject(person):
    chain = person[0]
    nobody = Chain(replace(chain.model, subject=None))
    with pytest.raises(PredictionError, match="subject"):
        Skeleton.of(nobody)
