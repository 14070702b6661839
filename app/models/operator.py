"""An operator model, opened: the person, the chain that is led, the methods that predict it."""

import hashlib
import struct
from dataclasses import dataclass
from pathlib import Path

from app.problems import Unreadable, UnsupportedFormat
from human import Chain, HumanModel
from prediction import Base, Hand, ModelFileError, OperatorModel, load_model


@dataclass(frozen=True, slots=True)
class Operator:
    """An opened model file.

    Attributes:
        id: Digest of the file.
        content: What it holds.
    """

    id: str
    content: OperatorModel

    @property
    def model(self) -> HumanModel:
        """The person's body."""
        return self.content.human_model

    @property
    def chain(self) -> Chain:
        """From what stays where it is to the led hand, or both."""
        return self.content.chain

    @property
    def hand(self) -> Hand:
        """The led hand: ``right``, ``left`` or ``both``."""
        assert self.content.skeleton is not None  # refused when it was opened
        return self.content.skeleton.hand

    @property
    def base(self) -> Base:
        """What of the body stays where it is: ``pelvis`` or ``feet``."""
        assert self.content.skeleton is not None
        return self.content.skeleton.fixed

    @property
    def tips(self) -> tuple[str, ...]:
        """Frames of the led hands, the right one first."""
        return self.chain.led


def is_model_file(path: Path) -> bool:
    """Returns whether a file begins as a model file does; false where there is none."""
    return path.is_file() and _may_be_safetensors(path)


def _may_be_safetensors(path: Path) -> bool:
    with path.open("rb") as stream:
        head = stream.read(9)
    if len(head) < 9:
        return False
    (size,) = struct.unpack("<Q", head[:8])
    return 0 < size <= path.stat().st_size and head[8:] == b"{"


def open_operator(path: Path, shown_as: str | None = None) -> Operator:
    """Opens a model file.

    Args:
        path: The file.
        shown_as: What to call it in errors; its name if not given.

    Raises:
        UnsupportedFormat: It is no model file.
        Unreadable: It is damaged, of another version, or of nobody.
    """
    name = shown_as or str(path)
    if path.is_file() and not _may_be_safetensors(path):
        raise UnsupportedFormat(f"{name} is not an operator model; 'ergocast train' makes one.")
    try:
        content = load_model(path)
    except ModelFileError as error:
        raise Unreadable(str(error).replace(str(path), name)) from error
    if content.skeleton is None:
        raise Unreadable(f"{name} is the model of a toy chain, not of a person.")
    with path.open("rb") as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
    return Operator(f"mdl_{digest}", content)
