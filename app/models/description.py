"""What an operator model holds, in plain values: for its record, ``inspect`` and ``train``."""

from dataclasses import asdict
from typing import Any

from app.plain import plain
from prediction import OperatorModel, joint_costs


def described(model: OperatorModel) -> dict[str, Any]:
    """Returns person, joints, takes, methods, report and options as JSON values.

    ``weights`` are the chosen method's as joint costs for IK; see `prediction.joint_costs`.
    """
    skeleton = model.skeleton
    assert skeleton is not None
    reduction = model.reduction
    follows = {name: reduction.coupling(name) for name in reduction.dropped_names}
    samples = model.samples
    return {
        "subject": asdict(skeleton.subject),
        "hand": skeleton.hand,
        "base": skeleton.fixed,
        "method": model.method,
        "chosen_by": model.training.get("chosen_by", ""),
        "methods": list(model.method_names),
        "tasks": list(model.tasks),
        "joints": {
            "learned": list(reduction.kept_names),
            "locked": [name for name, mix in follows.items() if not mix],
            "following": {name: plain(mix) for name, mix in follows.items() if mix},
        },
        "takes": [] if samples is None else [asdict(take) for take in samples.takes],
        "samples": model.training.get("samples", 0),
        "duration_s": model.training.get("duration_s", 0.0),
        "familiarity": {
            "centres": len(model.familiarity.centres),
            "level": plain(model.familiarity.level),
        },
        "weights": plain(joint_costs(model, task=model.tasks[0]).to_dict()),
        "findings": list(model.training.get("findings", ())),
        "metrics": plain(model.metrics),
        "options": plain(model.training.get("options", {})),
        "seed": model.seed,
        "versions": plain(model.training.get("versions", {})),
    }
