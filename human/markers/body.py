"""A person with markers on: a scaled model, and where on its segments each marker sits."""

from dataclasses import dataclass

import numpy as np

from human.markers.errors import MarkerBodyError
from human.model import Array, HumanModel, IntArray


@dataclass(frozen=True, slots=True, eq=False)
class MarkerBody:
    """A model scaled to a person, and the markers fixed to its segments.

    Made by `human.markers.body_from_static` from a recording, or by hand for other markers; what
    `human.markers.fit_markers` moves until it meets a recording.

    Attributes:
        model: the person.
        marker_names: ``markers`` names as in the recordings to fit, each once.
        segment: ``(markers,)`` index into ``model.segment_names`` of the segment that carries it.
        offset: ``(markers, 3)`` m, where it sits, in that segment's axes from its proximal joint.
        sd_m: ``(markers,)`` m, how far skin and placement let it stray from there along each axis.
        observed: segments whose posture the markers show; the others stay at a reference posture.
        notes: what was assumed or noticed, in words.

    Raises:
        MarkerBodyError: the arrays do not fit each other, or a value makes no sense.
    """

    model: HumanModel
    marker_names: tuple[str, ...]
    segment: IntArray
    offset: Array
    sd_m: Array
    observed: tuple[str, ...]
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Checks that the arrays fit each other."""
        count = len(self.marker_names)
        if len(set(self.marker_names)) != count:
            raise MarkerBodyError("marker_names: expected each name once.")
        for name, shape in (("segment", (count,)), ("offset", (count, 3)), ("sd_m", (count,))):
            value = getattr(self, name)
            if value.shape != shape or not np.all(np.isfinite(value)):
                raise MarkerBodyError(
                    f"{name}: expected finite values of shape {shape}, got shape {value.shape}."
                )
        if np.any(self.segment < 0) or np.any(self.segment >= len(self.model.segment_names)):
            raise MarkerBodyError(
                f"segment: expected indices below {len(self.model.segment_names)}, got "
                f"{sorted(set(self.segment.tolist()))}."
            )
        if np.any(self.sd_m <= 0.0):
            raise MarkerBodyError("sd_m: expected more than zero metres for every marker.")
        strange = set(self.observed) - set(self.model.segment_names)
        if strange:
            raise MarkerBodyError(f"observed: not segments of the model: {sorted(strange)}.")

    def unobserved(self) -> tuple[str, ...]:
        """Returns the segments whose posture no marker shows, in the model's order."""
        return tuple(name for name in self.model.segment_names if name not in self.observed)
