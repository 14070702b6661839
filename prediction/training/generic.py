"""An operator nobody has seen move: a generic W, and bands as wide as people differ from it."""

import hashlib
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from human import Chain
from prediction.chain import TASKS, JointReduction, ReducedChain, Task
from prediction.following.familiarity import Familiarity, widening
from prediction.following.posture_band import PostureBand
from prediction.laws.gaussian_laws import GaussianLaw, MinimumNormIk, WIk
from prediction.laws.null_space import NullSpaceBasis, weighted_pseudo_inverse
from prediction.model_file import model_bytes, model_from_bytes
from prediction.operator_model import FittedMethod, OperatorModel, Skeleton
from prediction.training.generic_prior import GenericPrior, generic_prior

Array = NDArray[np.float64]

#: Upper arm half way down and forearm half way up, degrees about x, y, z on the right side.
_AT_EASE = {"Shoulder": (70.0, 0.0, 20.0), "Elbow": (0.0, 0.0, 70.0)}


def generic_operator(
    chain: Chain, tasks: Sequence[Task] = TASKS, *, table: Mapping[str, Any] | None = None
) -> OperatorModel:
    """Returns the model of a person without demonstrations.

    Use it until there are demonstrations; then `train_operator`. It holds two methods: the one it
    uses, ``w-ik``, moves each joint in proportion to how fast people's joints usually move;
    ``minimum-norm`` moves them as little as can be. Neither is anybody's habit: the bands are as
    wide as people were found to differ from them. Familiarity is 0 everywhere, since nothing was
    seen.

    Args:
        chain: The person's chain; its model says whose it is.
        tasks: ``pose``, ``position`` or both.
        table: Numbers of another prior, as in the package's data file.

    Returns:
        The model; `OperatorModel.is_generic` is true of it.

    Raises:
        PredictionError: The chain's model has no subject.
        UnsupportedMethodError: The prior does not tell of a joint of the chain.

    Source: eq. 3 of Vianello et al. 2021 with W the root of the mobilities, half way (in logarithm)
    between the identity and other people's joint covariance, and with W = I; the numbers are
    ``prediction/data/generic_prior.json``.
    """
    names = chain.dof_names
    at_ease = np.clip(posture_at_ease(names), chain.lower, chain.upper)
    reduction = JointReduction.identity(names)
    methods: dict[tuple[str, Task], FittedMethod] = {}
    for law in (WIk, MinimumNormIk):
        for task in tasks:
            seen = ReducedChain(chain, reduction, at_ease, task)
            _, _, jacobian = seen.forward_and_jacobian(at_ease)
            prior = generic_prior(names, law.name, task, table)
            methods[law.name, task] = _fitted(law, jacobian, prior)
    model = OperatorModel(
        methods=methods,
        method=WIk.name,
        reduction=reduction,
        familiarity=Familiarity(np.empty((0, len(names))), 1.0, 1.0, 1.0),
        demonstrated=np.stack([at_ease, at_ease]),
        skeleton=Skeleton.of(chain),
        linear_rows=3 * len(chain.tips),
        seed=0,
        data_digest=hashlib.sha256(b"").hexdigest(),
        metrics={"demonstrations": "none"},
        training={
            "options": {"method": "generic", "tasks": list(tasks)},
            "chosen_by": "no demonstrations: W and bands are those of other people",
            "samples": 0,
            "takes": 0,
            "findings": ["this person was not seen: W and bands are those of other people"],
            "duration_s": 0.0,
            "versions": {
                "python": ".".join(map(str, sys.version_info[:3])),
                "numpy": np.__version__,
            },
        },
    )
    # As training does: what is in hand is bit for bit what will be loaded.
    return model_from_bytes(model_bytes(model))


def posture_at_ease(names: Sequence[str]) -> Array:
    """Returns a posture with the hands in front of the body, ``(n,)`` rad."""
    angles = np.zeros(len(names))
    for place, name in enumerate(names):
        joint, _, axis = name.rpartition("_rot")
        for side in ("Right", "Left"):
            turns = _AT_EASE.get(joint.removeprefix(f"j{side}"))
            if turns is not None:
                mirrored = side == "Left" and axis != "y"
                angles[place] = np.deg2rad(turns["xyz".index(axis)]) * (-1.0 if mirrored else 1.0)
    return angles


def _fitted(law: type[GaussianLaw], jacobian: Array, prior: GenericPrior) -> FittedMethod:
    """Returns a method whose null-space velocity spreads as joints of these speeds make it."""
    rate = prior.rate
    W = np.ones(len(rate)) if law is MinimumNormIk else rate / np.exp(np.log(rate).mean())
    basis = NullSpaceBasis.around(jacobian[None])
    frame = basis.frame(jacobian)
    free = np.eye(len(rate)) - weighted_pseudo_inverse(W, jacobian) @ jacobian
    spread = frame.matrix().T @ free * rate
    covariance = spread @ spread.T
    if law is MinimumNormIk:
        covariance = float(np.diagonal(covariance).mean()) * np.eye(len(covariance))
    predictor = law(W, np.zeros(len(covariance)), covariance, 1.0, basis)
    # Every posture is unfamiliar and widens the band; the prior is what it is widened to.
    unseen = float(widening(np.zeros(())))
    band = PostureBand(np.diag(prior.deviation) / unseen, prior.length, np.diag(rate**2))
    return FittedMethod(predictor, band, {})
