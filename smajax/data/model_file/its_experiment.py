"""The experiment file that a model was fitted to the runs of, where it can still be found."""

from __future__ import annotations

from pathlib import Path

from smajax.data.experiment.data_folder import data_folder
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.schema import read_schema
from smajax.data.model_file.record import ModelRecord

ABOVE = 3  # folders above that of the model file in which it is looked for


def experiment_of_model(model: ModelRecord, path: Path) -> tuple[Path, frozenset[Path]] | None:
    """(the file of that name and with those runs, in the folder of the model file `path`, one of those above it or the present one; the logs of its runs).

    None where there is none.
    """
    name = model.made_with.get("experiment", "")
    own = path if path.is_dir() else path.parent
    folders = [own, *(own / Path(*[".."] * up) for up in range(1, ABOVE + 1)), Path()]
    for folder in folders:
        file = folder / name
        try:
            if not name or not file.is_file():
                continue
            content = read_schema(file)
            logs = data_folder(file, content.data.folder).resolve()
        except ExperimentError:
            continue
        if {run.name for run in content.runs} == {run.name for run in model.runs}:
            files = [one for run in content.runs for one in (run.file, *(run.files or {}).values()) if one]
            return shortened(file), frozenset((logs / one).resolve() for one in files)
    return None


def shortened(file: Path) -> Path:
    """Without `..` where it is below the present folder."""
    here = Path.cwd()
    return file.resolve().relative_to(here.resolve()) if file.resolve().is_relative_to(here.resolve()) else file
