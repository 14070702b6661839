"""Methods that take what they need from the demonstrations' moments, without a search."""

from abc import abstractmethod
from typing import Self

import numpy as np

from prediction.demonstrations import Demonstrations
from prediction.laws.predictor import Predictor, Progress, ShouldStop, check_stop


class MomentFit(Predictor):
    """Fits and refits by one and the same computation."""

    @classmethod
    @abstractmethod
    def of_moments(cls, demonstrations: Demonstrations) -> Self:
        """Returns the predictor of these demonstrations, however few."""

    @classmethod
    def fit(
        cls,
        demonstrations: Demonstrations,
        rng: np.random.Generator,
        *,
        progress: Progress | None = None,
        should_stop: ShouldStop | None = None,
    ) -> Self:
        """Takes the moments; ``rng`` is not used.

        Raises:
            DemonstrationError: Too few samples.
            TrainingCancelledError: ``should_stop`` said so.
        """
        check_stop(should_stop)
        demonstrations.check_enough()
        return cls.of_moments(demonstrations)

    def refitted(self, demonstrations: Demonstrations) -> Self:
        """Takes the moments of other demonstrations, however few."""
        return self.of_moments(demonstrations)
