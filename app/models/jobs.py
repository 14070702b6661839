"""Trains operator models in the background; what was under way goes on after a restart."""

import hashlib
import json
from pathlib import Path
from typing import Any

from app.models.schemas import TrainingRequest
from app.models.service import Models
from app.operations.schemas import Operation
from app.operations.service import Control, Operations
from app.problems import Cancelled, InvalidRequest, Problem, Unreadable
from app.recordings.service import Recordings
from app.training_job import TrainingJob, training_job
from app.unfinished import Unfinished
from human import HumanError, SubjectError
from prediction import (
    PredictionError,
    TrainingCancelledError,
    UnsupportedMethodError,
    model_bytes,
)

#: Fields of a request that are options of the training.
_OPTIONS = ("method", "optimizer", "engine", "kernel", "criterion", "weights")
#: Steps that the progress of a training is told in.
_STEPS = 1000


class Trainings:
    """Queue of trainings; each keeps what it has finished in a folder until it ends.

    The folder's name is the digest of what was asked: the same request after a crash finds it, and
    no other.
    """

    def __init__(
        self, folder: Path, recordings: Recordings, models: Models, operations: Operations
    ) -> None:
        """Keeps what is under way under ``folder``."""
        self._folder = folder
        self._recordings = recordings
        self._models = models
        self._operations = operations
        operations.register("training", self._work)

    def ask(self, request: TrainingRequest) -> Operation:
        """Queues a training.

        Raises:
            NotFound: There is no such recording or model.
            InvalidRequest: The person is not known, or another than the model's.
            Unreadable: What was asked for cannot be.
            Busy: Too much work is waiting.
        """
        self._job(request)
        return self._operations.submit("training", request.model_dump(mode="json"))

    def _job(self, request: TrainingRequest) -> TrainingJob:
        try:
            return training_job(
                [self._recordings.take(identifier) for identifier in request.recordings],
                height_m=request.height_m,
                mass_kg=request.mass_kg,
                sex=request.sex,
                hand=request.hand,
                base=request.base,
                seed=request.seed,
                accept=request.accept,
                options={name: getattr(request, name) for name in _OPTIONS},
                add_to=None if request.add_to is None else self._models.open(request.add_to),
            )
        except (SubjectError, UnsupportedMethodError) as error:
            raise InvalidRequest(str(error)) from error
        except (HumanError, PredictionError) as error:
            raise Unreadable(str(error)) from error

    def _work(self, request: Any, control: Control) -> str:
        parsed = TrainingRequest.model_validate(request)
        job = self._job(parsed)
        about = job.about()
        asked = json.dumps(about, sort_keys=True).encode()
        unfinished = Unfinished(self._folder / hashlib.sha256(asked).hexdigest()[:32], about)

        def tell(what: str, done: float, nats: float | None) -> None:
            control.progress(round(_STEPS * done), _STEPS, "", what, log_likelihood=nats)

        try:
            trained = job.run(unfinished, tell, control.is_cancelled)
        except (Cancelled, TrainingCancelledError) as error:
            # Stopped with the service, it goes on at the next start; a client's word is final.
            if control.is_cancelled_by_client():
                unfinished.remove()
            raise Cancelled("The training was cancelled; no model was made.") from error
        except (HumanError, PredictionError) as error:
            unfinished.remove()
            raise Unreadable(str(error)) from error
        except Problem:
            unfinished.remove()
            raise
        record = self._models.add_content(model_bytes(trained.operator), parsed.name)
        unfinished.remove()
        return f"/v1/models/{record.id}"
