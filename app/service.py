"""The parts of the service behind the HTTP edge; the CLI uses the same ones."""

from app.assessments.service import Assessments
from app.estimates.service import Estimates
from app.files import scratch_file
from app.models.jobs import Trainings
from app.models.service import Models
from app.operations.service import Operations
from app.problems import ConfigurationError
from app.recordings.service import Recordings
from app.scores.service import Scores
from app.settings import Settings


class ErgocastService:
    """Everything that outlives one request, made from the settings alone."""

    def __init__(self, settings: Settings) -> None:
        """Opens the data folder named by ``settings``; nothing is written yet."""
        self.settings = settings
        self.operations = Operations(
            settings.data / "operations", settings.workers, settings.queue_limit
        )
        self.models = Models(settings.data / "models")
        self.recordings = Recordings(settings.data / "recordings")
        self.trainings = Trainings(
            settings.data / "trainings", self.recordings, self.models, self.operations
        )
        self.estimates = Estimates(settings.data / "estimates", self.recordings, self.operations)
        self.scores = Scores(settings.data / "scores", self.recordings, self.estimates)
        self.assessments = Assessments(
            settings.data / "assessments", self.models, self.operations, settings.sync_point_limit
        )

    def prepare(self) -> None:
        """Makes the data folder, private to its owner.

        Raises:
            ConfigurationError: It cannot be made or written to.
        """
        try:
            self.settings.data.mkdir(parents=True, exist_ok=True, mode=0o700)
        except OSError as error:
            raise ConfigurationError(
                f"The data folder {self.settings.data} cannot be made: {error.strerror}. "
                "Name another with --data or ERGOCAST_DATA."
            ) from error
        if not self.data_is_writable():
            raise ConfigurationError(
                f"The data folder {self.settings.data} cannot be written to. "
                "Name another with --data or ERGOCAST_DATA."
            )

    def start(self) -> None:
        """Makes the data folder and takes up unfinished work."""
        self.prepare()
        self.operations.start()

    def data_is_writable(self) -> bool:
        """Returns whether a file can be made in the data folder."""
        try:
            with scratch_file(self.settings.data):
                return True
        except OSError:
            return False

    def close(self) -> None:
        """Stops the threads; unfinished work stays on record."""
        self.operations.close()
