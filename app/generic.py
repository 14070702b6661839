"""The model of an operator of whom there are no recordings."""

from human import Chain, Subject, generate_model
from prediction import OperatorModel, generic_operator


def generic_operator_of(subject: Subject, hand: str) -> OperatorModel:
    """Returns the model of a person of whom stature and mass are all that is known.

    Args:
        subject: The person.
        hand: ``right`` or ``left``.
    """
    return generic_operator(Chain(generate_model(subject), tip=f"{hand.capitalize()}HandCOM"))
