"""Demonstrations of limbs that nothing measured: a reference posture is no motion to learn from."""

from collections.abc import Collection

from human import Chain
from human.names import JOINT_OF_SEGMENT
from prediction import DemonstrationError

#: Where a led hand or a standing foot can be; one of the two must have been measured.
_ENDS = {
    "right hand": ("RightForeArm", "RightHand"),
    "left hand": ("LeftForeArm", "LeftHand"),
    "right foot": ("RightLowerLeg", "RightFoot"),
    "left foot": ("LeftLowerLeg", "LeftFoot"),
}


def unseen_finding(chain: Chain, unobserved: Collection[str]) -> str | None:
    """Returns what of a chain a recording does not show, None where it shows all of it.

    Args:
        chain: What is to be learned.
        unobserved: Segments whose pose is a placeholder.

    Raises:
        DemonstrationError: It does not show where a led hand or a standing foot is.
    """
    joints = {name.rpartition("_")[0] for name in chain.dof_names}
    unseen = [
        segment
        for segment, joint in JOINT_OF_SEGMENT.items()
        if joint in joints and segment in unobserved
    ]
    for end, segments in _ENDS.items():
        if all(segment in unseen for segment in segments):
            raise DemonstrationError(
                f"neither {segments[0]} nor {segments[1]} was measured: where the {end} is, nobody "
                "knows. Choose a hand that was recorded, and the pelvis as what stays if the legs "
                "were not; or record that limb"
            )
    if not unseen:
        return None
    return (
        f"{', '.join(unseen)} not measured: taken to stay as in a reference posture, which the "
        "model then predicts"
    )
