"""The sections [priors.EFFECT] and [priors.presets]: what is known before the runs, in the place of the library's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from smajax.core.names import close_matches, of_many
from smajax.core.units import parse_quantity
from smajax.data.experiment.catalogue import Catalogue, CoefficientInfo, ModelDescription, ParameterInfo
from smajax.data.experiment.errors import ExperimentError, at_key, check_name
from smajax.data.experiment.record import DeclaredPriors, FromModelFile, PriorSpread
from smajax.data.experiment.schema import CoefficientPriorSection, EffectPriorSection, ExperimentFile, SpreadSection
from smajax.data.experiment.unknowns import bounded

CELSIUS = "degC"


def declared_priors(
    path: Path, file: ExperimentFile, catalogue: Catalogue, model: ModelDescription, kept: FromModelFile | None = None
) -> tuple[DeclaredPriors, list[str]]:
    """(the priors that the file gives, what it says of effects that are not tried). Raises ExperimentError at the key.

    `kept`: what its model file has, in the place of the presets.
    """
    odds: dict[str, float] = {}
    coefficients: dict[str, PriorSpread] = {}
    sections: Mapping[str, EffectPriorSection] = file.priors.model_extra or {}
    for effect, section in sections.items():
        key = f"priors.{effect}"
        check_name(path, key, "effect", effect, (*catalogue.effects, "presets"))
        _check_candidate(path, key, effect, file, kept)
        if section.odds is not None:
            odds[effect] = _odds(path, f"{key}.odds", section.odds, catalogue.odds)
        known = catalogue.coefficients(effect)
        own: Mapping[str, CoefficientPriorSection] = section.model_extra or {}
        for name, one in own.items():
            if name not in known:
                near = close_matches(name, [*known, "odds"], "known here")
                raise ExperimentError(path, f"{key}.{name}", f"{effect!r} has no coefficient {name!r}{near}")
            info, here = known[name], model.parameters.get(f"{effect}.{name}")
            info = info if here is None else replace(info, unit=here.unit, also=here.also)  # as on this load
            coefficients[f"{effect}.{name}"] = _coefficient(path, f"{key}.{name}", one, info)
    presets = _presets(path, file, model, kept.values if kept else {})
    return DeclaredPriors(odds, coefficients, presets), _not_tried(file, model, tuple(sections))


def _check_candidate(path: Path, key: str, effect: str, file: ExperimentFile, kept: FromModelFile | None) -> None:
    named = [name for name in (*file.model.parameters, *file.unknown) if name.split(".", 1)[0] == effect]
    if named:
        raise ExperimentError(
            path, key, f"{effect!r} is part of the model, since the file names {named[0]!r}; remove one of the two"
        )
    if kept is not None and effect in kept.effects:
        raise ExperimentError(path, key, f"{effect!r} is part of the model by its model file; remove this section")


def _odds(path: Path, key: str, given: str | float, classes: Mapping[str, float]) -> float:
    """Prior odds that the runs need an effect."""
    if isinstance(given, str):
        if given not in classes:
            known = {name: f"{name} ({odds:g})" for name, odds in classes.items()}
            near = close_matches(given, known.values(), "the classes are", known)
            raise ExperimentError(path, key, f"there is no class {given!r}{near}; or give a number above 0, at most 1")
        return classes[given]
    if not 0.0 < given <= 1.0:
        raise ExperimentError(
            path,
            key,
            f"got {given:g}, expected odds above 0 and at most 1; an effect that cannot be there goes into [effects] exclude",
        )
    return float(given)


def _coefficient(path: Path, key: str, section: CoefficientPriorSection, info: CoefficientInfo) -> PriorSpread:
    base = None if section.base is None else bounded(path, f"{key}.base", section.base, info)
    if base is not None and info.switch:
        raise ExperimentError(
            path,
            f"{key}.base",
            "the effect is off where this is zero, so its prior stands there; give width alone",
        )
    if section.width is None and section.relative is None:
        if info.logarithmic and base is not None and base <= 0.0:
            raise _no_logarithm(path, f"{key}.base", section.base)
        return PriorSpread(base, None, info.logarithmic)
    if section.relative is not None and not (info.positive if base is None else base > 0.0):
        raise _no_logarithm(path, f"{key}.relative", "a middle of 0" if base is None else section.base)
    return PriorSpread(base, *_spread(path, key, section, info))


def _no_logarithm(path: Path, key: str, got: object) -> ExperimentError:
    return ExperimentError(path, key, f"got {got}, which has no logarithm; give width = 'number unit' instead")


def _spread(path: Path, key: str, section: SpreadSection, info: ParameterInfo) -> tuple[float, bool]:
    """(standard deviation in the program's own unit or of the logarithm, whether of the logarithm)."""
    if section.relative is not None:
        return section.relative, True
    where = f"{key}.width"
    with at_key(path, where):
        width = parse_quantity(section.width or 0.0, info.unit, difference=True, also=info.also)
    if width <= 0.0:
        raise ExperimentError(path, where, f"got {section.width!r}, expected a standard deviation above zero")
    most = 0.5 * (info.high - info.low)
    if width > most:
        raise ExperimentError(
            path,
            where,
            f"got {section.width!r}, that is {width:g} {info.unit}; expected at most half of what makes physical sense, {most:g} {info.unit}",
        )
    return width, False


def _presets(
    path: Path, file: ExperimentFile, model: ModelDescription, begun: Mapping[str, float]
) -> dict[str, PriorSpread]:
    """How uncertain values of the presets are, about what these have, or a model file in their place (`begun`, SI)."""
    own = {name: info for name, info in model.parameters.items() if "." not in name}
    found = {}
    for name, section in file.priors.presets.items():
        key = f"priors.presets.{name}"
        if name not in own:
            lists = f"`smajax presets {file.model.wire} {file.model.load} {file.model.drive}` lists those of the model"
            raise ExperimentError(path, key, f"there is no parameter {name!r}{of_many(name, own, lists)}")
        places = {"[model.parameters]": set(file.model.parameters), "[unknown]": set(file.unknown)}
        places |= {f"[runs.parameters] of run {run.name!r}": set(run.parameters) for run in file.runs}
        given = [place for place, names in places.items() if name in names]
        if given:
            raise ExperimentError(
                path, key, f"{given[0]} gives it too, so it is not the preset's; remove one of the two"
            )
        info = own[name]
        base = None if section.base is None else bounded(path, f"{key}.base", section.base, info)
        value = begun.get(name, info.preset or 0.0) if base is None else base
        if section.relative is not None and (info.unit == CELSIUS or value == 0.0):
            got = f"{'a preset of' if base is None else 'a base of'} {value:g} {info.unit}".strip()
            raise _no_logarithm(path, f"{key}.relative", got)
        sigma, logarithmic = _spread(path, key, section, info)
        if logarithmic and value < 0.0:  # no logarithm, and a share of it all the same
            sigma, logarithmic = -sigma * value, False
        found[name] = PriorSpread(base, sigma, logarithmic)
    return found


def _not_tried(file: ExperimentFile, model: ModelDescription, effects: tuple[str, ...]) -> list[str]:
    warnings = []
    for name in effects:
        if model.effects is not None and name not in model.effects:
            warnings.append(f"[priors.{name}]: the effect changes nothing of this load and drive; it is not tried")
        elif name in file.effects.exclude or (file.effects.only is not None and name not in file.effects.only):
            warnings.append(f"[priors.{name}]: [effects] leaves it out; it is not tried")
    return warnings
