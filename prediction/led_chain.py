"""Which joints follow which hand, and what of the body stays where it is."""

from collections.abc import Sequence
from typing import Literal, get_args

from human import Chain, HumanModel
from human.names import BASE_SEGMENT
from prediction.errors import UnsupportedMethodError

Hand = Literal["right", "left", "both"]
Base = Literal["pelvis", "feet"]
HANDS: tuple[Hand, ...] = get_args(Hand)
BASES: tuple[Base, ...] = get_args(Base)

_LED: dict[Hand, tuple[str, ...]] = {
    "right": ("RightHandCOM",),
    "left": ("LeftHandCOM",),
    "both": ("RightHandCOM", "LeftHandCOM"),
}


def led_chain(model: HumanModel, hand: Hand = "right", base: Base = "pelvis") -> Chain:
    """Returns the chain of a person who is led.

    ========  ==========================  ==========================
    hand      pelvis stays                feet stay
    ========  ==========================  ==========================
    one       24 joints, task of 6 rows   42 joints, task of 12 rows
    both      36 joints, task of 12 rows  54 joints, task of 18 rows
    ========  ==========================  ==========================

    With the feet on the floor the chain starts at one foot and the other is a tip that is held, so
    the pelvis follows. It starts at the foot on the side of the led hand; the other would do as
    well, and mirrored people then get mirrored answers.

    Args:
        model: The person.
        hand: ``right``, ``left``, or ``both``, which hold one object.
        base: ``pelvis`` or ``feet``.

    Raises:
        UnsupportedMethodError: Another word.
    """
    if hand not in HANDS:
        raise UnsupportedMethodError("hand", str(hand), HANDS)
    if base not in BASES:
        raise UnsupportedMethodError("base", str(base), BASES)
    if base == "pelvis":
        return Chain(model, _LED[hand])
    near, far = ("LeftFoot", "RightFoot") if hand == "left" else ("RightFoot", "LeftFoot")
    return Chain(model, _LED[hand], near, (far,))


def hand_of(led: Sequence[str]) -> Hand:
    """Returns which hand the led tips are."""
    if len(led) > 1:
        return "both"
    return "left" if led[0].startswith("Left") else "right"


def base_of(base: str) -> Base:
    """Returns what stays where it is, of the segment a chain starts from."""
    return "pelvis" if base == BASE_SEGMENT else "feet"
