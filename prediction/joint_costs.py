"""A learned W as what IK libraries take: a cost for each joint."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prediction.chain import Task
from prediction.laws.mi_nsgp import MiNsGp
from prediction.laws.predictor import Predictor
from prediction.operator_model import OperatorModel

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class JointCosts:
    """What it costs this person to move each joint, for IK that minimises ``sum (cost_j dq_j)^2``.

    Attributes:
        cost: By joint; their geometric mean is one, since only ratios matter.
        weights: The diagonal of W by joint, geometric mean one: ``weight``, and for MI-NsGP the
            90 % interval ``low`` to ``high`` and whether the demonstrations bound it on both
            sides (``identified``), else None.
        held: Joints that do not move: fix them.
        coupled: Joints that move as a mix of others: share by joint.
        method: Whose W it is.
        exact: Whether IK with these costs moves the joints exactly as the method's W does.
        notes: What to know before use.
    """

    cost: Mapping[str, float]
    weights: Mapping[str, Mapping[str, float | bool | None]]
    held: tuple[str, ...]
    coupled: Mapping[str, Mapping[str, float]]
    method: str
    exact: bool
    notes: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Returns JSON values."""
        return asdict(self)


def joint_costs(
    model: OperatorModel,
    method: str | None = None,
    task: Task = "pose",
    q: Array | None = None,
) -> JointCosts:
    """Returns the joint costs of a trained method.

    Args:
        model: The operator.
        method: A trained method; the chosen one if not given.
        task: Which of its models.
        q: Posture of all joints, ``(n,)`` rad, for methods whose W depends on it.

    Returns:
        The costs.

    Raises:
        UnsupportedMethodError: The method was not trained.

    Source: the damping task of pink and of mink has the Hessian ``diag(cost)^2``, so
    ``cost_j = 1 / sqrt(w_j)``, with the hand's task far heavier, gives ``J_W^+ xdot``.
    Derived here: where W has correlations no diagonal is exact; its diagonal is the one whose
    Gaussian is nearest (least ``KL(N(0, W), N(0, diag d))``), at ``d_j = W_jj``.
    """
    name = model.method if method is None else method
    predictor = model.fitted(name, task).predictor
    reduction = model.reduction
    local = type(predictor).weights_at is not Predictor.weights_at
    W = predictor.weights if q is None or not local else predictor.weights_at(q[reduction.kept])
    exact = W.ndim == 1 or bool(np.array_equal(W, np.diag(np.diagonal(W))))
    variance = W if W.ndim == 1 else np.diagonal(W)
    log_cost = -0.5 * np.log(variance)
    cost = np.exp(log_cost - log_cost.mean())
    coupling = {joint: reduction.coupling(joint) for joint in reduction.dropped_names}
    notes = list(predictor.notes)
    if local and q is None:
        notes.append(f"the W of {name} depends on the posture: these are the costs far from all")
        notes[-1] += " demonstrations; pass a posture for those near it"
    if not exact:
        notes.append(
            f"the W of {name} has correlations between joints, which costs cannot express: the "
            "joints take part in proportion, not together as they were seen to"
        )
    interval = predictor.interval if isinstance(predictor, MiNsGp) else None
    weights: dict[str, dict[str, float | bool | None]] = {}
    for j, joint in enumerate(reduction.kept_names):
        weights[joint] = {"weight": float(1.0 / cost[j] ** 2), "low": None, "high": None}
        weights[joint]["identified"] = None
        if interval is not None:
            low, high = interval.low[j], interval.high[j]
            weights[joint] |= {"low": float(np.exp(low)), "high": float(np.exp(high))}
            weights[joint]["identified"] = bool(interval.identified[j])
    if interval is not None and not interval.identified.all():
        names = [n for n, told in weights.items() if not told["identified"]]
        notes.append(f"the demonstrations do not bound the weights of {', '.join(names)}")
    return JointCosts(
        cost=dict(zip(reduction.kept_names, cost.tolist(), strict=True)),
        weights=weights,
        held=tuple(joint for joint, mix in coupling.items() if not mix),
        coupled={joint: mix for joint, mix in coupling.items() if mix},
        method=name,
        exact=exact,
        notes=tuple(notes),
    )


def weights_in_words(costs: JointCosts) -> dict[str, str]:
    """Returns each weight with its interval as a person reads it."""
    words = {}
    for joint, told in costs.weights.items():
        words[joint] = f"{told['weight']:.3g}"
        if told["low"] is not None:
            words[joint] += f" ({told['low']:.2g} to {told['high']:.2g})"
        if told["identified"] is False:
            words[joint] += ", not identified"
    return words
