"""The bench: wire, load and drive from drawings, and the values of it that are known."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import tomlkit

from smajax.app.drafted import draft_file, run_files
from smajax.app.edit import edited, put, set_parameters
from smajax.app.model_facts import cards, rows_of
from smajax.app.project import Project
from smajax.app.ready import ready
from smajax.app.step import FieldError, Sent, Step
from smajax.core.units import UnitError, parse_quantity
from smajax.data.experiment.errors import ExperimentError
from smajax.data.readers.table import MeasuredDataError

if TYPE_CHECKING:
    from smajax.data.experiment.record import Experiment

KINDS = ("wire", "load", "drive")


def page(project: Project) -> Mapping[str, Any]:
    file = project.file
    rows = rows_of(file) if file else ()
    given = file.model.parameters if file else {}
    free = set(file.unknown) if file else set()
    parts = {part: [row for row in rows if row.part == part] for part in KINDS}
    known = {row.name for row in rows}
    return {
        "cards": cards(),
        "model": file.model if file else None,
        "first": [row for row in rows if row.first and row.part == "wire"],
        "of_load": parts["load"],
        "of_drive": parts["drive"],
        "rest": [row for row in parts["wire"] if not row.first],
        "given": given,
        "free": free,
        "others": {name: value for name, value in given.items() if name not in known},
    }


def save(project: Project, sent: Sent) -> str:
    if sent.action == "next":
        return "runs"
    if sent.action == "resistance":
        _resistance(project, sent)
        return ""
    file = project.file
    asked = {name: sent.values[f"model.{name}"] for name in KINDS if f"model.{name}" in sent.values}
    if file is not None and any(getattr(file.model, name) != value for name, value in asked.items()):
        _other_model(project, sent, asked)
    try:
        edited(project.path, lambda document: set_parameters(document, sent.values))
    except ExperimentError as error:
        raise FieldError("", str(error)) from None
    return ""


def _other_model(project: Project, sent: Sent, asked: Mapping[str, str]) -> None:
    """Draft again with other presets. What belonged to the wire of before (its bounds) is begun anew."""
    file = project.file
    assert file is not None
    changed = next(name for name, value in asked.items() if getattr(file.model, name) != value)
    choice = {name: asked.get(name, getattr(file.model, name)) for name in KINDS}
    if changed == "load" and (choice["load"] in ("coupon", "strain_coupon")) != (choice["drive"] == "none"):
        choice["drive"] = ""  # a coupon has no drive, and everything else has one
    files = list(dict.fromkeys(path for paths in run_files(project).values() for path in paths))
    try:
        draft_file(project, files, choice, project.decimal)
    except (MeasuredDataError, ExperimentError) as error:
        raise FieldError(f"model.{changed}", str(error).replace(f"{project.path}: ", "")) from None


def _resistance(project: Project, sent: Sent) -> None:
    """Resistivities from the resistance of the cold wire, by the functions of `new-experiment --ohms`."""
    ready()
    from smajax.data.experiment.draft_facts import PHASES, BenchFacts, checked
    from smajax.data.model_catalogue import describe

    file = project.file
    if file is None:
        raise FieldError("ohms", "the experiment file cannot be read yet")
    per_metre = sent.values.get("ohms_of") == "metre"
    unit = "ohm/m" if per_metre else "ohm"
    try:
        ohms = parse_quantity(sent.values.get("ohms", ""), unit, bare=unit)
    except UnitError as error:
        raise FieldError("ohms", str(error)) from None
    model = file.model
    described = describe(model.wire, model.load, model.drive)
    own = {name: info.preset for name, info in described.parameters.items() if info.preset is not None}
    known = {name: str(value) for name, value in model.parameters.items() if name not in PHASES}
    facts = BenchFacts(known, None if per_metre else ohms, ohms if per_metre else None)
    presets = f"{model.wire} {model.load} {model.drive}"
    try:
        found = checked(facts, project.path, presets, described, own, [run.name for run in file.runs])
        values = {f"model.parameters.{name}": found.values.get(name, "") for name in PHASES}

        def change(document: tomlkit.TOMLDocument) -> None:
            set_parameters(document, values)
            for name, (base, relative) in found.likely.items():
                prior = tomlkit.inline_table()
                prior.update({"base": base, "relative": relative})
                put(document, ("priors", "presets", name), prior)

        edited(project.path, change)
    except ExperimentError as error:
        raise FieldError("ohms", str(error).replace(f"{project.path}: ", "")) from None


def influences(project: Project) -> Mapping[str, Any]:
    """Which of the presets' values the runs depend on most, as `new-experiment` ranks them; takes some seconds the first time."""
    from smajax.data.experiment.draft_parameters import HEAD

    found = project.examined
    if found.experiment is None:
        return {"sentence": "", "remarks": {}}
    from smajax.attribution.preset_ranking import rank_presets
    from smajax.report.preset_words import NO_NUMBER, remarks, sentence, starts_of

    ranking = rank_presets(found.experiment)
    if ranking is None:
        return {"sentence": NO_NUMBER, "remarks": {}}
    said = remarks(ranking)
    begun = HEAD in project.text and _as_drafted(project, said, _of_the_preset(found.experiment, starts_of(ranking)))
    return {"sentence": sentence(ranking, begun=begun), "remarks": said}


def _of_the_preset(experiment: Experiment, starts: Mapping[str, str]) -> dict[str, str]:
    """Those of `starts` whose unknowns begin at the preset's value yet, and nowhere that the user chose."""
    from smajax.core.parameters import parameter_values
    from smajax.model.presets import build

    usual = parameter_values(build(experiment.wire, experiment.load, experiment.drive))
    begun = {one.name: one.start for one in experiment.unknowns}
    return {name: start for name, start in starts.items() if math.isclose(begun[name], usual[name], rel_tol=0.01)}


def _as_drafted(project: Project, said: Mapping[str, str], starts: Mapping[str, str]) -> bool:
    """Comments and starts of the draft, as `new-experiment` writes them, in a file that has its lines still; whether it begins at the `starts` then."""
    file = project.file
    if file is None:
        return False
    from smajax.data.experiment.draft_facts import PAYLOAD, Known
    from smajax.data.experiment.draft_model import DraftModel
    from smajax.data.experiment.draft_parameters import begun_at, ordered, preset_parameters

    model = file.model
    inputs = tuple(name for name, one in file.channels.items() if one.role == "input")
    masses = {run.name: str(run.inputs["mass"]) for run in file.runs if "mass" in run.inputs}
    payloads = {run.name: str(run.parameters[PAYLOAD]) for run in file.runs if PAYLOAD in run.parameters}
    likely = {name: (base, 0.0) for name, base in file.priors.bases.items()}
    known = Known(
        {name: str(value) for name, value in model.parameters.items()}, likely, masses=masses, payloads=payloads
    )
    drafted = preset_parameters(DraftModel(model.wire, model.load, model.drive, inputs, "", ""), known)
    text = ordered(begun_at(project.text, starts), drafted.presets, said)
    if text != project.text:

        def change(document: tomlkit.TOMLDocument) -> None:
            if tomlkit.dumps(document) == project.text:  # else it has been edited meanwhile
                document.clear()
                document.update(tomlkit.parse(text))

        edited(project.path, change)
    return bool(starts)


STEP = Step("bench", "Bench", page, save, keys=("model",), needs="experiment", to_look_at=True)
