"""What an experiment file says of effects: their names, and which of them go together."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from smajax.data.experiment.catalogue import Catalogue, ModelDescription
from smajax.data.experiment.errors import ExperimentError, check_name
from smajax.data.experiment.record import FromModelFile
from smajax.data.experiment.schema import ExperimentFile


def check_effects(path: Path, file: ExperimentFile, catalogue: Catalogue, kept: FromModelFile | None) -> None:
    """Names of effects, lists of them that contradict each other or the model, and effects of the model that exclude each other. Raises ExperimentError."""
    only, excluded = file.effects.only or [], file.effects.exclude
    for key, effects in (("effects.only", only), ("effects.exclude", excluded)):
        for effect in effects:
            check_name(path, key, "effect", effect, catalogue.effects)
    declared = {name: f"{name}, in its model file" for name in (kept.effects if kept else ())}
    declared |= {name.split(".", 1)[0]: name for name in (*file.model.parameters, *file.unknown) if "." in name}
    _check_groups(path, file, declared, catalogue)
    for effect in excluded:
        if effect in only:
            raise ExperimentError(
                path, "effects.exclude", f"{effect!r} is in effects.only too; remove it from one of them"
            )
        if effect in declared:
            raise ExperimentError(
                path,
                "effects.exclude",
                f"{effect!r} is part of the model, since the file names {declared[effect]!r}; remove one of the two",
            )


def _check_groups(path: Path, file: ExperimentFile, declared: Mapping[str, str], catalogue: Catalogue) -> None:
    """declared: effect of the model -> by which name the file declares it. ExperimentError where two are of one group."""
    first: dict[str, str] = {}
    for effect, named in declared.items():
        group = catalogue.groups.get(effect, "")
        other = first.setdefault(group, effect) if group else effect
        if other != effect:
            raise ExperimentError(
                path,
                f"unknown.{named}"
                if named in file.unknown
                else f"model.parameters.{named}"
                if named in file.model.parameters
                else "model.file",
                f"got {effect!r} beside {other!r} (the file names {declared[other]!r}), expected one effect at most that describes the "
                f"{group}: they exclude each other; remove the values of one of the two",
            )


def useless(file: ExperimentFile, model: ModelDescription) -> list[str]:
    """Effects that are asked for, or kept out, and that this model cannot show."""
    if model.effects is None:
        return []
    none = "which changes nothing of this load and drive"
    asked = [
        f"effects.only names {name!r}, {none}; it is not tried"
        for name in file.effects.only or []
        if name not in model.effects
    ]
    return asked + [
        f"effects.exclude names {name!r}, {none}; it would not be tried anyway"
        for name in file.effects.exclude
        if name not in model.effects
    ]
