"""Answers assessments, at once or in the background, and keeps each answer by its content."""

import hashlib
import io
import json
import threading
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from app.assessments.assess import Outcome, assess
from app.assessments.posture import PostureRecord
from app.assessments.schemas import AssessmentItem, AssessmentRequest
from app.files import check_id, dump_json, read_json, write_bytes, write_json
from app.models.operator import Operator
from app.models.service import Models
from app.operations.schemas import Operation
from app.operations.service import Control, Operations
from app.problems import NotFound
from app.version import VERSION

#: Changes whenever the same request would be answered otherwise than before.
_REVISION = 5

Progress = Callable[[int, int], None]


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


class Assessments:
    """One folder per assessment: the answer, a line for the list, the predicted postures.

    An assessment's id is the digest of what was asked and of the software that answers; asking the
    same again gives the stored bytes.
    """

    def __init__(
        self, folder: Path, models: Models, operations: Operations, sync_point_limit: int
    ) -> None:
        """Keeps answers under ``folder``; many points (``sync_point_limit``) go to background."""
        self._folder = folder
        self._models = models
        self._operations = operations
        self._limit = sync_point_limit
        self._storing = threading.Lock()
        operations.register("assessment", self._work)

    def answer(self, request: AssessmentRequest, in_background: bool) -> bytes | Operation:
        """Returns the assessment, or the operation that will make it.

        Raises:
            NotFound: There is no such model.
            InvalidRequest: The shared part of the request does not fit the model.
            Busy: Too much work is waiting.
        """
        operator = self._models.open(request.model_id)
        stored = self._stored(self._identifier(request, operator))
        if stored is not None:
            return stored
        if in_background or request.points() > self._limit:
            return self._operations.submit("assessment", request.model_dump(mode="python"))
        return self.make(request, operator)

    def make(
        self, request: AssessmentRequest, operator: Operator, progress: Progress | None = None
    ) -> bytes:
        """Makes and stores an assessment; returns its bytes."""
        identifier = self._identifier(request, operator)
        outcome = assess(request, operator, progress)
        return self._store(identifier, request, outcome)

    def content(self, identifier: str) -> bytes:
        """Returns a stored assessment's bytes.

        Raises:
            NotFound: There is none by that id.
        """
        stored = self._stored(check_id(identifier, "assessment"))
        if stored is None:
            raise NotFound(f"There is no assessment {identifier!r}.")
        return stored

    def posture(self, identifier: str, candidate_id: str) -> bytes:
        """Returns the predicted body along one candidate, as JSON.

        Raises:
            NotFound: There is no such assessment or candidate, or the candidate was rejected.
        """
        home = self._folder / check_id(identifier, "assessment")
        answer = json.loads(self.content(identifier))
        for index, candidate in enumerate(answer["candidates"]):
            if candidate["id"] == candidate_id:
                if candidate["problem"] is not None:
                    raise NotFound(f"Candidate {candidate_id!r} was not assessed: see its problem.")
                content = (home / f"posture-{index}.npz").read_bytes()
                with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
                    return dump_json(PostureRecord.from_arrays(dict(arrays)).to_dict())
        raise NotFound(f"Assessment {identifier} has no candidate {candidate_id!r}.")

    def all(self) -> list[AssessmentItem]:
        """Returns one line per assessment, newest first."""
        if not self._folder.is_dir():
            return []
        items = [
            AssessmentItem.model_validate(read_json(path))
            for path in self._folder.glob("asm_*/summary.json")
        ]
        return sorted(items, key=lambda item: (item.created, item.id), reverse=True)

    def _identifier(self, request: AssessmentRequest, operator: Operator) -> str:
        asked = json.dumps(request.model_dump(mode="python"), sort_keys=True)
        key = "\n".join([VERSION, str(_REVISION), operator.id, asked])
        return f"asm_{hashlib.sha256(key.encode()).hexdigest()}"

    def _stored(self, identifier: str) -> bytes | None:
        path = self._folder / identifier / "assessment.json"
        return path.read_bytes() if path.is_file() else None

    def _store(self, identifier: str, request: AssessmentRequest, outcome: Outcome) -> bytes:
        with self._storing:
            stored = self._stored(identifier)
            if stored is not None:
                return stored
            home = self._folder / identifier
            created = _now()
            answer: dict[str, Any] = {"id": identifier, "created": created, **outcome.result}
            # First: what cannot be said leaves nothing behind.
            content = dump_json(answer)
            for index, record in enumerate(outcome.postures):
                if record is not None:
                    buffer = io.BytesIO()
                    np.savez(buffer, **record.to_arrays())  # type: ignore[arg-type]
                    write_bytes(home / f"posture-{index}.npz", buffer.getvalue())
            item = AssessmentItem(
                id=identifier,
                created=created,
                model_id=request.model_id,
                n_candidates=len(request.candidates),
                name=request.name,
            )
            write_bytes(home / "assessment.json", content)
            # Last: what the list shows is complete.
            write_json(home / "summary.json", item.model_dump())
            return content

    def _work(self, request: Any, control: Control) -> str:
        parsed = AssessmentRequest.model_validate(request)
        operator = self._models.open(parsed.model_id)
        identifier = self._identifier(parsed, operator)
        if self._stored(identifier) is None:
            self.make(
                parsed,
                operator,
                lambda done, total: control.progress(done, total, "candidates", "predicting"),
            )
        return f"/v1/assessments/{identifier}"
