"""An experiment file with further runs: the text of the old one, whose runs and comments stay, and a section of each new log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from smajax.core.wording import and_listed
from smajax.data.experiment.bench_mass import parse_mass
from smajax.data.experiment.data_folder import data_folder
from smajax.data.experiment.draft import Draft
from smajax.data.experiment.draft_facts import PAYLOAD
from smajax.data.experiment.errors import ExperimentError, at_key
from smajax.data.experiment.from_model_file import with_model_file
from smajax.data.experiment.schema import ExperimentFile, read_schema
from smajax.data.experiment.toml_file import toml_value
from smajax.data.model_catalogue import describe


def extended(
    path: Path, logs: Sequence[Path], target: Path, masses: Mapping[str, str] | None = None, mass: str = ""
) -> Draft:
    """The experiment file `path` with `logs` as further fit runs, each named as its file, for the file `target` beside it.

    Their columns are those of the file. masses: of runs by name; mass: of all others. Raises ExperimentError for a target in another folder,
    from which the file's paths would lead elsewhere, a log out of the data folder, one that is a run there, and a name that is taken.
    """
    old = read_schema(path)
    if target.resolve().parent != path.resolve().parent:
        beside = path.parent / "again.toml"
        raise ExperimentError(
            target, "", f"is in another folder than {path}, whose paths begin there; give --out {beside} or so"
        )
    folder = data_folder(path, old.data.folder).resolve()
    payload = (masses or mass) and _has_payload(path, old)
    own, taken = dict(masses or {}), {run.name for run in old.runs}
    files = {
        (folder / one).resolve(): run.name for run in old.runs for one in (run.file, *(run.files or {}).values()) if one
    }
    text = path.read_text(encoding="utf-8-sig").rstrip("\n")
    lines = []
    for log in logs:
        name = log.stem
        if not log.resolve().is_relative_to(folder):
            raise ExperimentError(
                target,
                f"runs.{name}.file",
                f"{log} is out of the data folder {folder} of {path}; put it there, or write another [data] folder in that file",
            )
        of = files.get(log.resolve())
        if of is not None:
            raise ExperimentError(
                target, f"runs.{name}.file", f"{log} is the log of run {of!r} of {path}; leave it out"
            )
        if name in taken:
            raise ExperimentError(
                target, f"runs.{name}.name", f"{path} has a run of that name; rename {log}, or leave it out"
            )
        taken.add(name)
        weight = own.pop(name, mass)
        lines += ["", "[[runs]]", f"name = {toml_value(name)}", 'role = "fit"']
        if weight:
            with at_key(target, f"runs.{name}.{f'parameters.{PAYLOAD}' if payload else 'inputs.mass'}"):
                parse_mass(weight)
            table, key = ("parameters", PAYLOAD) if payload else ("inputs", "mass")
            lines.append(f"{table} = {{ {key} = {toml_value(weight)} }}")
        lines.append(f"file = {toml_value(log.resolve().relative_to(folder).as_posix())}")
    if own:
        raise ExperimentError(target, f"runs.{next(iter(own))}.inputs.mass", "there is no such log among the new ones")
    kept = and_listed([run.name for run in old.runs])
    message = f"runs: those of {path.name} ({kept}), and fit runs of {and_listed([log.name for log in logs])}, with its columns"
    return Draft("\n".join([text, *lines, ""]), (message,))


def _has_payload(path: Path, file: ExperimentFile) -> bool:
    """Whether the mass of a run is a parameter of the experiment's load, and no channel. Raises ExperimentError."""
    whole, _ = with_model_file(path, file)
    model = whole.model
    try:
        described = describe(model.wire, model.load, model.drive, model.law)
    except (KeyError, ValueError):
        return False  # what is wrong is said when the file is loaded
    return "mass" not in described.inputs_optional and PAYLOAD in described.parameters
