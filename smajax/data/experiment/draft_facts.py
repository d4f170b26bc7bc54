"""What a user says of a bench in one go: known values, the wire's resistance, the mass of each run; checked before a draft is written."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from smajax.core.names import close_matches
from smajax.core.units import UnitError, parse_quantity
from smajax.core.wording import and_listed
from smajax.data.experiment.bench_mass import parse_mass
from smajax.data.experiment.catalogue import ModelDescription, ParameterInfo
from smajax.data.experiment.draft_model import DraftModel
from smajax.data.experiment.errors import ExperimentError, check_parameter
from smajax.data.experiment.name_hints import mass_hint
from smajax.data.experiment.unknowns import bounded
from smajax.data.model_catalogue import describe
from smajax.data.model_file.actuator_model import ActuatorModel

PHASES = ("resistivity_martensite", "resistivity_austenite")
# By what share of it their ratio may differ from that of the preset, which is 1.1: data sheets of NiTi have 76 and 82, and 80 and 100 uohm cm, and the
# resistance of many trained wires falls by 10 % and more when they are heated.
HOT_RESISTIVITY = 0.2
PAYLOAD = "payload_mass"  # the parameter of a load that has the mass of a run, and no channel of it


@dataclass(frozen=True)
class BenchFacts:
    """As given: values with their units by parameter; resistance (ohm, or ohm/m) of the cold wire; mass with its unit by run.

    mass: with its unit, of every run that `masses` does not name.
    """

    known: Mapping[str, str] = field(default_factory=dict)
    ohms: float | None = None
    ohms_per_metre: float | None = None
    masses: Mapping[str, str] = field(default_factory=dict)
    mass: str = ""


@dataclass(frozen=True)
class Known:
    """Checked: values with their units by parameter, where those that were computed come from, masses by run; and messages.

    likely: values about which a prior lies, since nobody measured them on this wire, with how far they may be off (relative). payloads: masses
    by run of a load that has them as its parameter `payload_mass`; of the other runs it is among the values.
    """

    values: Mapping[str, str] = field(default_factory=dict)
    likely: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    origins: Mapping[str, str] = field(default_factory=dict)
    masses: Mapping[str, str] = field(default_factory=dict)
    payloads: Mapping[str, str] = field(default_factory=dict)
    messages: tuple[str, ...] = ()


def facts_of(
    bench: BenchFacts, target: Path, model: DraftModel, kept: ActuatorModel | None, runs: Sequence[str]
) -> tuple[Known, list[str]]:
    """(what is known of the bench, checked; a message where the names of the runs say masses). Raises ExperimentError."""
    law = "" if kept is None else kept.law
    described = describe(model.wire, model.load, model.drive, law)
    values = {name: info.preset for name, info in described.parameters.items() if info.preset is not None}
    if kept is not None:
        values |= {name: one.value for name, one in kept.parameters.items()}
    presets = f"{model.wire} {model.load} {model.drive}"
    given = {"mass"} & set(model.inputs)
    if given and (bench.masses or bench.mass):
        key = f"runs.{next(iter(bench.masses), runs[0])}.inputs.mass"
        raise ExperimentError(target, key, "the logs have a mass themselves; leave --mass out")
    known = checked(bench, target, presets, described, values, runs)
    if given or known.masses or "mass" not in described.inputs_optional:
        return known, []
    diameter = known.values.get("wire_diameter")
    metres = values["wire_diameter"] if diameter is None else parse_quantity(diameter, "m")
    hint = mass_hint(runs, metres)
    return known, [hint] if hint else []


def diameter_of(bench: BenchFacts) -> float | None:
    """The wire's diameter in m where it is known; None of what is none, which `checked` refuses."""
    try:
        diameter = parse_quantity(bench.known["wire_diameter"], "m")
    except (KeyError, UnitError):
        return None
    return diameter if diameter > 0.0 else None


def checked(
    facts: BenchFacts, path: Path, presets: str, model: ModelDescription, own: Mapping[str, float], runs: Sequence[str]
) -> Known:
    """The facts of a bench with the model `presets` (as for `smajax presets`), whose values are `own` (SI), and these `runs`.

    Raises ExperimentError for the experiment file `path` as it would be raised with these values written into it.
    """
    numbers = {}
    for name, value in facts.known.items():
        key = f"model.parameters.{name}"
        check_parameter(path, key, name, model.parameters, presets)
        numbers[name] = bounded(path, key, value, model.parameters[name])
    values, messages = dict(facts.known), []
    likely: dict[str, tuple[str, float]] = {}
    origins: dict[str, str] = {}
    if facts.ohms is not None or facts.ohms_per_metre is not None:
        found, measured, hot = _resistivities(facts, path, numbers, own, model.parameters)
        cold_name, hot_name = PHASES
        values[cold_name], likely[hot_name] = found[cold_name], (found[hot_name], HOT_RESISTIVITY)
        origins |= {cold_name: measured, hot_name: hot}
        messages.append(f"{cold_name} = {found[cold_name]}: {measured}")
        messages.append(
            f"{hot_name} = {found[hot_name]} within {100 * HOT_RESISTIVITY:g} %: {hot}; a fit may correct it"
        )
    masses = _masses(facts, path, presets, model, runs)
    if not masses or "mass" in model.inputs_optional:
        return Known(values, likely, origins, masses, messages=tuple(messages))
    values |= {PAYLOAD: facts.mass} if facts.mass else {}
    payloads = {run: value for run, value in masses.items() if run in facts.masses}
    return Known(values, likely, origins, payloads=payloads, messages=tuple(messages))


def _resistivities(
    facts: BenchFacts,
    path: Path,
    numbers: Mapping[str, float],
    own: Mapping[str, float],
    known: Mapping[str, ParameterInfo],
) -> tuple[dict[str, str], str, str]:
    """(resistivities of both phases by name, where each comes from): R A/l_0 of the cold wire, the hot one by the preset's ratio."""
    twice = [name for name in PHASES if name in numbers]
    if twice or (facts.ohms is not None and facts.ohms_per_metre is not None):
        both = f"`{twice[0]}` and a resistance" if twice else "a resistance and one per metre"
        raise ExperimentError(
            path, f"model.parameters.{PHASES[0]}", f"got {both}, which say the same; give one of them"
        )
    values = {**own, **numbers}
    area = 0.25 * math.pi * values["wire_diameter"] ** 2
    sizes = ["wire_diameter"] if facts.ohms is None else ["wire_length", "wire_diameter"]
    per_metre = facts.ohms_per_metre if facts.ohms is None else facts.ohms / values["wire_length"]
    assert per_metre is not None
    what = f"{facts.ohms:g} ohm" if facts.ohms is not None else f"{facts.ohms_per_metre:g} ohm/m"
    said = [f"{name} {values[name]:.4g} m" + ("" if name in numbers else " (the preset's)") for name in sizes]
    ratio = own["resistivity_austenite"] / own["resistivity_martensite"]
    why = f"{what} of the cold wire with {and_listed(said)}"
    found = {}
    for name, value in zip(PHASES, (per_metre * area, ratio * per_metre * area), strict=True):
        info = known[name]
        found[name] = f"{value:.4g} {info.unit}"
        if not info.low <= value <= info.high:
            raise ExperimentError(
                path,
                f"model.parameters.{name}",
                f"{why}: that is {value:.4g} {info.unit}; expected {info.low:g} to {info.high:g} {info.unit}: is the resistance in "
                f"ohm, and are {and_listed(sizes)} those of this wire (--known)?",
            )
    return found, why, f"{ratio:.4g} times martensite's, as the preset has it"


def _masses(
    facts: BenchFacts, path: Path, presets: str, model: ModelDescription, runs: Sequence[str]
) -> dict[str, str]:
    """Mass by run, of all runs or of none."""
    if not facts.masses and not facts.mass:
        return {}
    first = next(iter(facts.masses), runs[0])
    channel = "mass" in model.inputs_optional
    if not channel and PAYLOAD not in model.parameters:
        raise ExperimentError(
            path,
            f"runs.{first}.inputs.mass",
            f"the model of {presets} takes no mass of each run (a dead_weight does); give a parameter of it with --known for all runs, or "
            f"under [[runs]] as parameters = {{ NAME = '...' }} for one; `smajax presets {presets}` lists them",
        )
    own, place = ("load_mass", "inputs.mass") if channel else (PAYLOAD, f"parameters.{PAYLOAD}")
    if facts.mass and own in facts.known:
        raise ExperimentError(
            path, f"model.parameters.{own}", "got it and a mass of every run, which say the same; give one of them"
        )
    unknown = [run for run in facts.masses if run not in runs]
    if unknown:
        near = close_matches(unknown[0], runs, "there are")
        raise ExperimentError(path, f"runs.{unknown[0]}.{place}", f"there is no run {unknown[0]!r}{near}")
    for run, value in {**(dict.fromkeys(runs, facts.mass) if facts.mass else {}), **facts.masses}.items():
        key = f"runs.{run}.{place}"
        try:
            number = parse_mass(value) if channel else bounded(path, key, value, model.parameters[own])
        except UnitError as error:
            raise ExperimentError(path, key, str(error)) from None
        if channel and not number > 0.0:
            raise ExperimentError(path, key, f"got {value!r}; expected more than 0 kg")
    others = facts.mass or facts.known.get(own, "")
    missing = [run for run in runs if run not in facts.masses]
    if missing and not others:
        raise ExperimentError(
            path,
            f"runs.{missing[0]}.{place}",
            f"is missing: {and_listed([repr(run) for run in facts.masses])} {'has' if len(facts.masses) == 1 else 'have'} a mass; give "
            f"--mass {missing[0]}=... too, or one --mass without a name for all the others",
        )
    return {run: facts.masses.get(run) or others for run in runs}
