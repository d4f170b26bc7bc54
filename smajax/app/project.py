"""A project: the state of one working folder, read afresh for each request, as an immutable record."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from smajax.app.confined import OutsideError, inside, is_inside
from smajax.app.jobs import Job, last_job
from smajax.app.log_files import Log, found_in, log_of, stamp
from smajax.app.ready import loaded, ready
from smajax.core.names import listed
from smajax.core.units import UnitError, parse_quantity
from smajax.data.experiment.data_folder import data_folder
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.record import Experiment
from smajax.data.experiment.schema import ExperimentFile, is_counted, read_schema

EXPERIMENT = "experiment.toml"
# The page that a command writes into its folder, and its record -> the command.
PAGES: Mapping[str, tuple[str, str]] = {
    "report.html": ("close-loop", "report.json"),
    "identify.html": ("identify", "identify.json"),
    "predict.html": ("predict", "predict.json"),
    "tune.html": ("tune", "tune.json"),
}


@dataclass(frozen=True)
class Result:
    """A folder that a command wrote, with the file names of its page and its record."""

    folder: str
    command: str
    page: str
    record: str


@dataclass(frozen=True)
class Examined:
    """The experiment file as the commands read it: the experiment, or what is wrong with it, by key; neither where nobody looked yet."""

    experiment: Experiment | None
    errors: Mapping[str, str]


@dataclass(frozen=True)
class Project:
    """root: what was chosen at the start (resolved). folder: this project's, in it. text: of the experiment file, "" for none."""

    root: Path
    folder: Path
    text: str
    log_paths: tuple[Path, ...]
    results: tuple[Result, ...]
    job: Job | None

    @property
    def own(self) -> str:
        """The folder as an address has it, relative to the root; "" for the root itself."""
        own = self.folder.relative_to(self.root).as_posix()
        return "" if own == "." else own

    @property
    def path(self) -> Path:
        return self.folder / EXPERIMENT

    @property
    def stamp(self) -> str:
        """What changes when anything does that a page shows."""
        files = [stamp(one) for one in self.log_paths]
        pages = [stamp(self.folder / one.folder / one.page) for one in self.results]
        job = (self.job.began, self.job.state) if self.job else None
        return hashlib.sha256(repr((self.text, files, pages, job, loaded())).encode()).hexdigest()[:16]

    @cached_property
    def logs(self) -> tuple[Log, ...]:
        return tuple(log_of(self.folder, one, self.decimal) for one in self.log_paths)

    @cached_property
    def decimal(self) -> str:
        """The decimal mark that the experiment file declares for its logs."""
        return (self.file.data.decimal or "") if self.file else ""

    @cached_property
    def file(self) -> ExperimentFile | None:
        """The experiment file by its shape alone, which takes no time; None where that is wrong."""
        try:
            return read_schema(self.path) if self.text else None
        except ExperimentError:
            return None

    @property
    def counted_step(self) -> float | None:
        """s between samples that are counted, where the file says it."""
        file = self.file
        if file is None or file.sampling is None or not is_counted(file.time):
            return None
        with suppress(UnitError):
            return parse_quantity(file.sampling.step, "s")
        return None

    @cached_property
    def examined(self) -> Examined:
        if not self.text:
            return Examined(None, {})
        return _examined(self.root, self.path, self.text, tuple(stamp(one) for one in self.log_paths))

    def log_at(self, own: str) -> Path:
        """A log by its path in the project. Raises OutsideError."""
        path = inside(self.root, (self.folder / own).as_posix())
        if path not in {one.resolve() for one in self.log_paths}:
            raise OutsideError(f"{own!r} is no log of this folder")
        return path

    def result(self, *commands: str) -> Result | None:
        """The newest result of one of these commands."""
        fitting = [one for one in self.results if one.command in commands]
        return max(fitting, key=lambda one: stamp(self.folder / one.folder / one.page)[1], default=None)

    def record_of(self, result: Result) -> dict[str, Any]:
        """The numbers that the command wrote beside its page; empty where it wrote none yet."""
        try:
            found = json.loads((self.folder / result.folder / result.record).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return found if isinstance(found, dict) else {}


def read_project(root: Path, own: str) -> Project:
    """The project in the folder `own` of `root` (resolved). Raises OutsideError for one that is elsewhere or is not there."""
    folder = inside(root, own)
    if not folder.is_dir():
        raise OutsideError(f"{own!r} is no folder in {root}")
    path = folder / EXPERIMENT
    results = results_in(folder)
    text = ""
    if path.is_file() and is_inside(root, path):
        try:
            text = path.read_text(encoding="utf-8-sig")
        except (OSError, UnicodeDecodeError):
            text = "#"  # there is one, and examining it says what is wrong
    logs = found_in(root, folder, [one.folder for one in results])
    return Project(root, folder, text, logs, results, last_job(folder))


def results_in(folder: Path) -> tuple[Result, ...]:
    """Of the commands, in the folders right below."""
    try:
        below = sorted(one for one in folder.iterdir() if one.is_dir() and not one.is_symlink())
    except OSError:
        return ()
    return tuple(
        Result(one.name, command, page, record)
        for one in below
        for page, (command, record) in PAGES.items()
        if (one / page).is_file()
    )


def messages(error: ExperimentError) -> dict[str, str]:
    """What is wrong by key, as the command line says it; several keys of one file are lines of one error."""
    found: dict[str, str] = {}
    for number, line in enumerate(str(error).split(f"\n{error.path}: ")):
        rest = line.removeprefix(f"{error.path}: ")
        key, sign, text = rest.partition(": ")
        if number == 0:
            key, sign, text = error.key, ": ", rest.removeprefix(f"{error.key}: ")
        found.setdefault(key if sign else "", text if sign else rest)
    return found


@lru_cache(maxsize=16)
def _examined(root: Path, path: Path, text: str, logs: tuple[tuple[str, int, int], ...]) -> Examined:
    """`text` and `logs` are what the result depends on."""
    try:
        file = read_schema(path)
        check_files(root, path, file)
        ready()
        from smajax.data.open_experiment import open_experiment

        return Examined(open_experiment(path), {})
    except ExperimentError as error:
        return Examined(None, messages(error))


def check_files(root: Path, path: Path, file: ExperimentFile) -> None:
    """ExperimentError where the experiment would read a file that is not in `root`."""
    folder = data_folder(path, file.data.folder)
    if not is_inside(root, folder):
        raise ExperimentError(path, "data.folder", f"{folder} is not in {root}; `smajax app` reads no files outside it")
    for run in file.runs:
        for name in [run.file] if run.file else list((run.files or {}).values()):
            if name and not is_inside(root, folder / name):
                raise ExperimentError(
                    path, f"runs.{run.name}.file", f"{name!r} is not in {root}; `smajax app` reads no files outside it"
                )
    if file.model.file and not is_inside(root, path.parent / file.model.file):
        raise ExperimentError(
            path, "model.file", f"{file.model.file!r} is not in {root}; `smajax app` reads no files outside it"
        )


def commands_in_words(project: Project) -> str:
    """Which results there are, for a list of folders."""
    return listed(sorted({one.command for one in project.results})) if project.results else ""
