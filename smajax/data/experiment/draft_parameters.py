"""[model.parameters], [unknown] and [nuisance] of a draft: what is known of the bench, what the preset has, and what is to be fitted."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from smajax.core.parameters import parameter_values, parameters
from smajax.data.experiment.catalogue import WIRE_SIZES
from smajax.data.experiment.draft_facts import PAYLOAD, Known
from smajax.data.experiment.draft_model import DraftModel
from smajax.data.experiment.toml_file import quantity, toml_key, toml_value
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.model.presets import build
from smajax.model.system import System

# Parameter -> how far its bounds lie from the preset's value: factors, or kelvins.
FACTORS = {"convection_coefficient": (0.2, 4.0), "specific_heat": (0.5, 3.0), "recoverable_strain": (0.3, 2.0)}
KELVINS = {"austenite_start": 25.0, "austenite_finish": 30.0, "martensite_start": 25.0, "martensite_finish": 30.0}
HEAD = "[model.parameters]  # known values of your bench, each with its unit; the others are the preset's"


@dataclass(frozen=True)
class PresetLine:
    """A value that is the preset's, as a comment of the file; listed: in every draft, the others where they matter on the runs."""

    name: str
    value: str
    about: str
    listed: bool

    def text(self, remark: str = "") -> str:
        return f'# {self.name} = "{self.value}"  # {self.about}' + (f"; {remark}" if remark else "")


@dataclass(frozen=True)
class ParameterSections:
    """Lines of the three sections, messages about their guesses, and the values that are the preset's."""

    lines: Sequence[str]
    messages: Sequence[str]
    presets: tuple[PresetLine, ...] = ()


def ordered(text: str, presets: Sequence[PresetLine], remarks: Mapping[str, str]) -> str:
    """The file with the values that are the preset's in the order of `remarks`, by name, each with its own; then the others."""
    if not presets:
        return text
    by_name = {one.name: one for one in presets}
    first = [by_name[name].text(remark) for name, remark in remarks.items() if name in by_name]
    rest = [one.text() for one in presets if one.listed and one.name not in remarks]
    before = [one.text() for one in presets if one.listed]
    return text.replace("\n".join([HEAD, *before]), "\n".join([HEAD, *first, *rest]), 1)


def begun_at(text: str, starts: Mapping[str, str]) -> str:
    """The file with other starts of unknowns, by name, each with its unit."""
    for name, start in starts.items():
        line = rf'(?m)^({re.escape(name)} = \{{.*\bstart = )"[^"]*"'
        text = re.sub(line, rf'\g<1>"{start}"', text)
    return text


def amount(value: float, unit: str, places: int, like: float | None = None) -> str:
    """A value (SI) rounded to so many digits, with its unit, as a draft has it; `like`: see `toml_file.quantity`."""
    rounded = float(f"{value:.{places}g}")
    text = quantity(rounded, unit, like)
    return text if isinstance(text, str) else f"{rounded:.{places}g}"


def _given(known: Known) -> list[str]:
    """Lines of what is known."""
    lines = []
    for name, value in known.values.items():
        why = known.origins.get(name, "")
        lines.append(f"{toml_key(name)} = {toml_value(value)}" + (f"  # {why}" if why else ""))
    return lines


def _likely(known: Known) -> list[str]:
    """The section [priors.presets] of what is known of the bench by its likely size alone."""
    if not known.likely:
        return []
    lines = ["[priors.presets]  # how uncertain values are that nobody measured on this wire: close-loop fits them too"]
    for name, (value, relative) in known.likely.items():
        why = known.origins.get(name, "")
        prior = f"{{ base = {toml_value(value)}, relative = {relative:g} }}"
        lines.append(f"{toml_key(name)} = {prior}" + (f"  # {why}" if why else ""))
    return [*lines, ""]


def _preset_lines(model: DraftModel, system: System, known: Known, unknown: Sequence[str]) -> tuple[PresetLine, ...]:
    """Values of wire, load and drive that are the preset's; listed are those from a ruler, a balance or a data sheet."""
    table, values = parameters(system), parameter_values(system)
    heated = model.drive != "none"
    out = {*known.values, *known.likely, *unknown} | (
        {"load_mass"} if "mass" in model.inputs or known.masses else set()
    )
    out |= {PAYLOAD} if known.payloads else set()
    sizes = [*WIRE_SIZES, *["ambient_temperature"] * heated] if model.load != "coupon" else []
    parts = [name for name, one in table.items() if one.path[0] in ("load", "drive")]
    rest = [name for name, one in table.items() if one.path[0] == "wire" and name not in sizes]
    return tuple(
        PresetLine(name, amount(values[name], table[name].unit, 4), table[name].about, name not in rest)
        for name in (*sizes, *parts, *rest)
        if name not in out
    )


def _unknowns(model: DraftModel, system: System, known: Known) -> dict[str, str]:
    """The parameters that no data sheet has, with bounds around the preset's values: name -> its line."""
    table, values = parameters(system), parameter_values(system)
    heated = model.drive != "none"
    lines = {}
    for name, (low, high) in FACTORS.items():
        if not heated and name != "recoverable_strain":
            continue
        value = values[name]
        box = (max(low * value, table[name].low), min(high * value, table[name].high), value)
        shown = [amount(one, table[name].unit, 3, value) for one in box]
        lines[name] = f'{name} = {{ low = "{shown[0]}", high = "{shown[1]}", start = "{shown[2]}" }}'
    for name, width in KELVINS.items():
        value = values[name]
        lines[name] = (
            f'{name} = {{ low = "{value - width:g} degC", high = "{value + width:g} degC", start = "{value:g} degC" }}'
        )
    return {name: line for name, line in lines.items() if name not in known.values}


def preset_parameters(model: DraftModel, known: Known) -> ParameterSections:
    """Known values, those of the presets as comments, unknown ones with bounds, and the nuisance parameters."""
    preset = build(model.wire, model.load, model.drive)
    unknowns = _unknowns(model, preset, known)
    presets = _preset_lines(model, preset, known, list(unknowns))
    listed = [one for one in presets if one.listed]
    lines = [
        HEAD,
        *(one.text() for one in listed),
        *_given(known),
        "",
        f"[unknown]  # to be fitted: bounds around the values of {model.wire}, and the initial guess; for another wire",
        "# draft again with `--wire NAME --overwrite`, or move them",
        *unknowns.values(),
        "",
        "[nuisance]",
        "offset = true  # the sensor's zero may differ from run to run",
        "",
        *_likely(known),
    ]
    if not listed:
        return ParameterSections(lines, known.messages, presets)
    some = ", ".join(f"{one.name} {one.value}" for one in listed[:4])
    message = (
        f"the bench: the preset's {some}{' and others' if len(listed) > 4 else ''} until [model.parameters] has yours, from the same "
        f"command with `--known {listed[0].name}=VALUE,... --overwrite` or by hand; a wrong one leads to a wrong fitted value"
    )
    return ParameterSections(lines, [*known.messages, message], presets)


def kept_parameters(model: DraftModel, kept: ActuatorModel, known: Known) -> ParameterSections:
    """What was fitted before, as unknown again: its bounds, begun at the values of the file; and what is known.

    Of a file in which nothing was fitted those that no data sheet has, with bounds around its values.
    """
    out = {*known.values, *known.likely}
    fitted = {name: one for name, one in kept.parameters.items() if one.origin == "fitted" and name not in out}
    lines = [
        "[model.parameters]  # known values that differ from the model file's, each with its unit",
        *_given(known),
        "",
        "[unknown]  # what was fitted before: bounds, and where the fit begins; without a line it is held to its error by the model file"
        if fitted
        else "[unknown]  # to be fitted: bounds around the values of the model file, in which nothing was",
    ]
    if not fitted:
        given = {name for name, one in kept.parameters.items() if one.origin == "given"}
        lines += [line for name, line in _unknowns(model, kept.system, known).items() if name not in given]
    for name, one in fitted.items():
        unit = kept.table[name].unit
        shown = {"low": one.low, "high": one.high, "start": one.value}
        box = ", ".join(f"{key} = {toml_value(amount(value, unit, 10, one.value))}" for key, value in shown.items())
        why = "" if name in kept.errors else "  # the runs of before did not determine it"
        lines.append(f"{toml_key(name)} = {{ {box} }}{why}")
    offset = any(one.offset for one in kept.outputs) or not kept.outputs
    lines += ["", "[nuisance]", f"offset = {toml_value(offset)}", "", *_likely(known)]
    return ParameterSections(lines, known.messages)
