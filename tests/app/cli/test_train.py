"""``ergocast train`` as a job: broken off, taken up, added to, and what ``inspect`` says of it."""

import json
from pathlib import Path
from typing import Any, ClassVar

import pytest

import prediction.training.train
from app.cli import train as train_command
from app.cli.output import progress_bar
from prediction import load_model
from tests.app.cli.running import Capture, failed, run

PERSON = ["--height", 1.72, "--mass", 68, "--sex", "female"]
QUICK = ["--method", "cov-ik"]
#: Two for the held-out comparison, two for each of two tasks.
FITS = 6


class Told:
    """The bar, overheard."""

    shown: ClassVar[list[str]] = []

    def __init__(self, quiet: bool) -> None:
        self._inner = progress_bar(quiet)

    def __enter__(self) -> Any:
        self.progress = self._inner.__enter__()
        update = self.progress.update

        def overheard(task: Any, **fields: Any) -> None:
            Told.shown.append(fields["description"])
            update(task, **fields)

        self.progress.update = overheard
        return self.progress

    def __exit__(self, *error: Any) -> None:
        self._inner.__exit__(*error)


class Fits:
    """Counts fits; Ctrl-C comes in the one of the given number."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, stop_at: int) -> None:
        self.made: list[str] = []
        fit = prediction.training.train.fit_predictor

        def counted(name: str, *args: Any, **options: Any) -> Any:
            if len(self.made) + 1 == stop_at:
                self.made.append("stopped")
                raise KeyboardInterrupt
            self.made.append(name)
            return fit(name, *args, **options)

        monkeypatch.setattr(prediction.training.train, "fit_predictor", counted)


def test_a_broken_off_training_goes_on_and_gives_the_same_bytes(
    tmp_path: Path,
    reaches: tuple[Path, Path],
    trained_file: Path,
    capsys: Capture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    out = tmp_path / "mine.safetensors"
    fits = Fits(monkeypatch, stop_at=4)
    monkeypatch.setattr(train_command, "progress_bar", Told)
    Told.shown.clear()
    assert run("train", reaches[0], *PERSON, *QUICK, "--out", out) == 130
    said = " ".join(capsys.readouterr().err.split())
    assert "3 fits are done" in said and "the same command goes on" in said
    (folder,) = tmp_path.iterdir()
    assert folder.name == "mine.safetensors.unfinished"
    assert folder.stat().st_mode & 0o077 == 0
    # another training is not mixed with it, and says in what it differs
    said = failed(capsys, "train", reaches[0], *PERSON, "--method", "sb-m", "--out", out)
    assert "method: cov-ik then, sb-m now" in said and "--restart" in said
    assert "hand" not in said
    before = len(fits.made)
    assert run("train", reaches[0], *PERSON, *QUICK, "--out", out, "--json") == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out)["method"] == "cov-ik" and captured.err == ""
    assert len(fits.made) - before == FITS - 3
    assert out.read_bytes() == trained_file.read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["mine.safetensors"]
    assert any("held-out comparison, cov-ik (pose)" in one for one in Told.shown)
    assert any("training, minimum-norm (position)" in one for one in Told.shown)
    assert any(one.endswith("nats a sample") for one in Told.shown)


def test_restart_begins_anew_and_touches_nothing_else(
    tmp_path: Path,
    reaches: tuple[Path, Path],
    capsys: Capture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    out = tmp_path / "mine.safetensors"
    Fits(monkeypatch, stop_at=2)
    assert run("train", reaches[0], *PERSON, "--method", "sb-m", "--out", out) == 130
    capsys.readouterr()
    (folder,) = tmp_path.iterdir()
    assert json.loads((folder / "about.json").read_text())["method"] == "sb-m"
    monkeypatch.undo()
    again = Fits(monkeypatch, stop_at=2)
    assert run("train", reaches[0], *PERSON, *QUICK, "--out", out, "--restart", "--json") == 130
    assert "Going on" not in capsys.readouterr().err
    assert again.made == ["cov-ik", "stopped"]
    assert json.loads((folder / "about.json").read_text())["method"] == "cov-ik"
    strange = tmp_path / "other.safetensors.unfinished"
    strange.mkdir()
    (strange / "diary.txt").write_text("mine")
    other = tmp_path / "other.safetensors"
    said = failed(capsys, "train", reaches[0], *PERSON, *QUICK, "--out", other, "--restart")
    assert "no training" in said and (strange / "diary.txt").read_text() == "mine"


def test_what_a_crash_left_is_gone_on_with_or_thrown_away(
    tmp_path: Path,
    reaches: tuple[Path, Path],
    capsys: Capture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    out = tmp_path / "mine.safetensors"
    Fits(monkeypatch, stop_at=2)
    command = ["train", reaches[0], *PERSON, *QUICK, "--out", out]
    assert run(*command) == 130
    capsys.readouterr()
    about = tmp_path / "mine.safetensors.unfinished" / "about.json"
    for damaged in ('{"met', "[1]"):
        about.write_text(damaged)
        said = failed(capsys, *command)
        assert "about.json in it is damaged" in said and "--restart" in said
    about.unlink()  # as where a crash came while the folder was emptied
    assert run(*command) == 0
    assert "1 fits are done" in " ".join(capsys.readouterr().err.split())
    assert [path.name for path in tmp_path.iterdir()] == [out.name]


def test_a_full_disk_is_said_in_words(
    tmp_path: Path,
    reaches: tuple[Path, Path],
    capsys: Capture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    out = tmp_path / "mine.safetensors"
    said = failed(capsys, "train", reaches[0], *PERSON, *QUICK, "--out", out)
    assert "mine.safetensors" in said and "No space left" in said
    assert not out.exists()


def test_inspect_shows_what_a_model_holds(trained_file: Path, capsys: Capture) -> None:
    assert run("inspect", trained_file, "--json") == 0
    model = json.loads(capsys.readouterr().out)
    assert model["format"] == "ergocast-operator-model"
    assert model["subject"] == {"height_m": 1.72, "mass_kg": 68.0, "sex": "female"}
    (take,) = model["takes"]
    assert (take["name"], take["samples"]) == ("one.bvh", model["samples"])
    joints = model["joints"]
    held = load_model(trained_file).reduction
    assert joints["learned"] == list(held.kept_names)
    assert sorted([*joints["locked"], *joints["following"]]) == sorted(held.dropped_names)
    assert run("inspect", trained_file) == 0
    page = capsys.readouterr().out
    for words in ("1.72 m, 68 kg, female", "right hand", "cov-ik *", "minimum-norm", "one.bvh"):
        assert words in page
    for at in ("0.25 s", "0.5 s", "1 s", "2 s"):
        assert at in page
    assert "personal data" in page


def test_recordings_are_added_once_and_of_one_person(
    tmp_path: Path, reaches: tuple[Path, Path], trained_file: Path, capsys: Capture
) -> None:
    out = tmp_path / "more.safetensors"
    cases: list[tuple[list[object], str]] = [
        ([reaches[0]], "one.bvh is the same recording as one.bvh"),
        ([reaches[0], "--hand", "left"], "hand right, got left"),
        ([reaches[0], "--mass", 70], "mass 68.0, got 70"),
        ([], "none"),
    ]
    for options, words in cases:
        said = failed(capsys, "train", *options, "--add-to", trained_file, "--out", out)
        assert words in " ".join(said.split())
    assert "not an operator model" in failed(
        capsys, "train", reaches[0], "--add-to", reaches[0], "--out", out
    )
    said = failed(capsys, "train", reaches[0], reaches[0], *PERSON, *QUICK, "--out", out)
    assert "same recording" in said
    assert list(tmp_path.iterdir()) == []
