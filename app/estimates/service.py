"""Makes estimates in the background and keeps each by its content."""

import hashlib
import json
import shutil
import threading
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from app.estimates.schemas import Estimate, EstimateItem, EstimateOptions, EstimateRequest
from app.estimates.series import Series
from app.estimation import BODY, SERIES, estimate_take
from app.files import check_id, dump_json, read_json, write_bytes, write_json
from app.operations.schemas import Operation
from app.operations.service import Control, Operations
from app.problems import NotFound, Unreadable
from app.recordings.service import Recordings
from app.takes import Take
from app.version import VERSION
from estimation import EstimationError
from human.errors import HumanError

#: Changes whenever the same request would be answered otherwise than before.
_REVISION = 2
#: Most rows of one answer of time series; the Parquet file has them all.
MOST_ROWS = 20_000


class Estimates:
    """One folder per estimate: summary, time series, the person's URDF.

    An estimate's id is the digest of what was asked, of the recording's files and of the software;
    asking the same again leads to the stored one.
    """

    def __init__(self, folder: Path, recordings: Recordings, operations: Operations) -> None:
        """Keeps estimates under ``folder``."""
        self._folder = folder
        self._recordings = recordings
        self._operations = operations
        self._storing = threading.Lock()
        operations.register("estimate", self._work)

    def ask(self, request: EstimateRequest) -> Operation:
        """Queues an estimate.

        Raises:
            NotFound: There is no such recording.
            Busy: Too much work is waiting.
        """
        self._recordings.get(request.recording_id)
        return self._operations.submit("estimate", request.model_dump(mode="json"))

    def content(self, identifier: str) -> bytes:
        """Returns a summary's bytes.

        Raises:
            NotFound: There is no such estimate.
        """
        return self._path(identifier, "estimate.json").read_bytes()

    def series(
        self, identifier: str, columns: list[str], start_s: float | None, end_s: float | None
    ) -> bytes:
        """Returns some columns over some time, as JSON.

        Raises:
            NotFound: There is no such estimate.
            InvalidRequest: There is no such column.
        """
        series = Series(self._path(identifier, SERIES))
        part = series.part(columns, start_s, end_s, MOST_ROWS)
        return dump_json({"columns": part, "units": series.units(list(part))})

    def parquet(self, identifier: str) -> Path:
        """Returns the path of the time series.

        Raises:
            NotFound: There is no such estimate.
        """
        return self._path(identifier, SERIES)

    def urdf(self, identifier: str) -> bytes:
        """Returns the person's body as URDF.

        Raises:
            NotFound: There is no such estimate.
        """
        return self._path(identifier, BODY).read_bytes()

    def all(self) -> list[EstimateItem]:
        """Returns one line per estimate, newest first."""
        if not self._folder.is_dir():
            return []
        items = [
            EstimateItem.model_validate(read_json(path))
            for path in self._folder.glob("est_*/item.json")
        ]
        return sorted(items, key=lambda item: (item.created, item.id), reverse=True)

    def _path(self, identifier: str, name: str) -> Path:
        home = self._folder / check_id(identifier, "estimate")
        # The list's line is written last: without it the estimate is not complete.
        if not (home / "item.json").is_file():
            raise NotFound(f"There is no estimate {identifier!r}.")
        return home / name

    def _identifier(self, request: EstimateRequest, take: Take) -> str:
        asked = json.dumps(request.model_dump(mode="json"), sort_keys=True)
        parts = [f"{role} {part.path.name} {part.name}" for role, part in take.parts().items()]
        key = "\n".join([VERSION, str(_REVISION), asked, *parts])
        return f"est_{hashlib.sha256(key.encode()).hexdigest()}"

    def _work(self, request: Any, control: Control) -> str:
        parsed = EstimateRequest.model_validate(request)
        take = self._recordings.take(parsed.recording_id)
        identifier = self._identifier(parsed, take)
        home = self._folder / identifier
        if not (home / "item.json").is_file():
            # What a service that was killed left half-done is begun anew.
            shutil.rmtree(home, ignore_errors=True)
            home.mkdir(parents=True, exist_ok=True)
            try:
                self._make(identifier, parsed, take, control)
            except (HumanError, EstimationError) as error:
                raise Unreadable(str(error)) from error
            finally:
                if not (home / "item.json").is_file():
                    shutil.rmtree(home, ignore_errors=True)
        return f"/v1/estimates/{identifier}"

    def _make(
        self, identifier: str, request: EstimateRequest, take: Take, control: Control
    ) -> None:
        options = EstimateOptions.model_validate(request.model_dump(exclude={"recording_id"}))
        home = self._folder / identifier
        found = estimate_take(
            take,
            options,
            home,
            lambda what, done, total: control.progress(done, total or None, "frames", what),
        )
        created = datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
        answer = Estimate.model_validate(
            {
                "id": identifier,
                "recording_id": request.recording_id,
                "created": created,
                **found,
                "series_url": f"/v1/estimates/{identifier}/series",
                "model_urdf_url": f"/v1/estimates/{identifier}/urdf",
            }
        )
        item = EstimateItem.model_validate(
            answer.model_dump(include=set(EstimateItem.model_fields))
        )
        with self._storing:
            write_bytes(home / "estimate.json", dump_json(answer.model_dump(mode="json")))
            write_json(home / "item.json", item.model_dump())
