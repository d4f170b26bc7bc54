"""An experiment file begun from measured logs: what can be guessed filled in, what cannot as a comment."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from smajax.experiment.guess import DRIVES, GUESS, LIKELY, SURE, TIME, Column, columns_of
from smajax.measured.read import read_table
from smajax.measured.table import MeasuredDataError, Table
from smajax.parameters import parameter_values, parameters
from smajax.presets import build
from smajax.units import convert

MOST_SAMPLES = 2000  # of the longest run on the clock
HELD_OUT_FROM = 3  # runs from which on the last one is held out
COUPON, HEATED = ("temperature", "stress"), ("voltage", "current", "power", "duty")
# Parameter -> how far its bounds lie from the preset's value: factors, or kelvins.
FACTORS = {"convection_coefficient": (0.2, 4.0), "specific_heat": (0.5, 3.0), "recoverable_strain": (0.3, 2.0)}
KELVINS = {"austenite_start": 25.0, "austenite_finish": 30.0, "martensite_start": 25.0, "martensite_finish": 30.0}


@dataclass(frozen=True)
class Guessed:
    """The text of the file, and what was guessed in it, each with how sure."""

    text: str
    told: tuple[str, ...]


@dataclass(frozen=True)
class _Model:
    wire: str
    load: str
    drive: str
    inputs: tuple[str, ...]
    output: str
    why: str


def _model(found: dict[str, Column]) -> _Model:
    drive = next((name for name in DRIVES if name in found), "")
    if not drive and "temperature" in found and "strain" in found and "stress" in found:
        return _Model(
            "flexinol_isobaric", "coupon", "none", COUPON, "strain", "temperature, stress and strain without a drive"
        )
    if "angle" in found:
        return _Model(
            "niti_table_3_1", "arm", drive or "voltage", (drive or "voltage",), "angle", "the output is an angle"
        )
    inputs = (drive or "voltage", *(["mass"] if "mass" in found else []))
    why = "the output is a position; `bias_spring` is the other load that has one"
    return _Model("flexinol_table_3_2", "dead_weight", drive or "voltage", inputs, "position", why)


def _key(column: Column, table: Table) -> str:
    word = "variable" if table.clocks else "column"
    return f"{word} = {json.dumps(column.key, ensure_ascii=False)}"


def _channel(name: str, role: str, column: Column, table: Table, off: bool) -> list[str]:
    lines = [
        f"[channels.{name}]  # {column.sure}: {column.why}",
        f'role = "{role}"',
        _key(column, table),
        f"unit = {json.dumps(column.unit, ensure_ascii=False)}",
    ]
    if role == "output":
        lines.append('noise = "estimate"  # or its sigma, such as "0.01 mm"')
    return [f"# {line}" if off else line for line in lines]


def _round(step: float) -> float:
    """Up to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(step))
    return float(next(nice * power for nice in (1.0, 2.0, 5.0, 10.0) if nice * power >= step * (1.0 - 1e-9)))


def _clock(table: Table, columns: Sequence[Column]) -> np.ndarray | None:
    """Times of the file in seconds, by its own clock or its time column."""
    if table.clocks:
        return np.asarray(next(iter(table.clocks.values())))
    time = next((one for one in columns if one.quantity == TIME), None)
    return None if time is None else convert(table.columns[time.name], time.unit, "s")


def _unknowns(model: _Model) -> list[str]:
    """The parameters that no sheet tells, with bounds around the preset's."""
    system = build(model.wire, model.load, model.drive)
    table, values = parameters(system), parameter_values(system)
    heated = model.drive != "none"
    lines = []
    for name, (low, high) in FACTORS.items():
        if not heated and name != "recoverable_strain":
            continue
        unit, value = table[name].unit.replace("-", ""), values[name]
        box = (max(low * value, table[name].low), min(high * value, table[name].high), value)
        shown = [f"{one:.3g} {unit}".strip() for one in box]
        lines.append(f'{name} = {{ low = "{shown[0]}", high = "{shown[1]}", start = "{shown[2]}" }}')
    for name, width in KELVINS.items():
        value = values[name]
        lines.append(
            f'{name} = {{ low = "{value - width:g} degC", high = "{value + width:g} degC", start = "{value:g} degC" }}'
        )
    return lines


def _folder(files: Sequence[Path], target: Path) -> Path:
    common = Path(os.path.commonpath([file.resolve().parent for file in files]))
    return Path(os.path.relpath(common, target.resolve().parent))


def begun(files: Sequence[Path], target: Path, title: str = "") -> Guessed:
    """The experiment file `target` for these logs, one run each. Raises MeasuredDataError for a file that cannot be read.

    The columns are those of the first file; another file without one of them is refused by name.
    """
    tables = [read_table(file) for file in files]
    first = tables[0]
    columns = columns_of(first)
    found = {one.quantity: one for one in columns if one.quantity}
    model = _model(found)
    for table in tables[1:]:
        for one in columns:
            if one.quantity:
                table.name_of(one.key)
    told = [f"{one.name}: {one.quantity} in {one.unit} ({one.sure}: {one.why})" for one in columns if one.quantity]
    told += [f"{one.name}: left out ({one.why})" for one in columns if not one.quantity]
    told.append(
        f"model: {model.wire}, {model.load}, {model.drive} ({GUESS}: {model.why}; `smajax presets` has the others)"
    )
    missing = [name for name in (*model.inputs, model.output) if name not in found]
    folder = _folder(files, target)
    lines = [
        f'# Begun by `smajax new-experiment`. Lines that say "{GUESS}" or "{LIKELY}" want a look; "{SURE}" ones come from',
        "# headings with units. What the model can be: `smajax presets`; what may be fitted: studies/parameters.md.",
        f"title = {json.dumps(title or target.stem, ensure_ascii=False)}",
        "",
        f"[model]  # {GUESS}: {model.why}",
        f'wire = "{model.wire}"',
        f'load = "{model.load}"',
        f'drive = "{model.drive}"',
        "",
        "[model.parameters]  # what is known of your bench, each with its unit; the rest is the preset's",
        '# wire_length = "537 mm"',
        '# wire_diameter = "150 um"',
    ]
    lines += ['# ambient_temperature = "23 degC"'] if model.drive != "none" else []
    lines += ['# load_mass = "75 g"'] if model.load == "dead_weight" and "mass" not in found else []
    lines += ["", "[unknown]  # to be fitted: bounds around the preset's values, and where the search starts"]
    lines += [*_unknowns(model), "", "[nuisance]", "offset = true  # the sensor's zero may move from run to run", ""]
    clocks = [_clock(table, columns) for table in tables]
    if clocks[0] is None:
        lines += ["[time]  # no column is a time: samples are counted", 'kind = "sample"', ""]
        told.append(f"time: none found, samples are counted ({GUESS})")
    else:
        if TIME in found:
            time = found[TIME]
            lines += [
                f"[time]  # {time.sure}: {time.why}",
                f"column = {json.dumps(time.key, ensure_ascii=False)}",
                f'unit = "{time.unit}"',
                "",
            ]
        known = [clock for clock in clocks if clock is not None]
        usual = max(float(np.median(np.diff(clock))) for clock in known)
        step = _round(max(usual, max(float(np.ptp(clock)) for clock in known) / MOST_SAMPLES))
        irregular = any(np.ptp(np.diff(clock)) > 0.5 * usual for clock in known)
        lines += ["[sampling]  # the clock that all signals are brought to", f'step = "{1e3 * step:g} ms"', ""]
        told.append(
            f"sampling: every {usual:.4g} s{', irregular' if irregular else ''}; the fit takes {step:g} s ({LIKELY})"
        )
    used = {TIME, *model.inputs, model.output}
    for name in model.inputs:
        if name in found:
            lines += [*_channel(name, "input", found[name], first, False), ""]
    if model.output in found:
        lines += [*_channel(model.output, "output", found[model.output], first, False), ""]
    for name in missing:
        role = "output" if name == model.output else "input"
        lines += [
            f"# {name}: no column was found for this {role}, which the model needs. Complete:",
            f"# [channels.{name}]",
        ]
        lines += [f'# role = "{role}"', '# column = "?"', '# unit = "?"', ""]
        told.append(f"{name}: MISSING, an {role} that the model needs")
    spare = [one for one in columns if one.quantity and one.quantity not in used]
    sensors = {"temperature", "stress", "force", "strain", "resistance"}
    for one in spare:
        role = "output" if one.quantity in sensors else "input"
        lines += [
            f"# Not used by this model, or only by `smajax identify`: {one.name}",
            *_channel(one.quantity, role, one, first, True),
            "",
        ]
    lines += ["[data]", f"folder = {json.dumps(str(folder), ensure_ascii=False)}", ""]
    base = (target.resolve().parent / folder).resolve()
    for number, file in enumerate(files):
        role = "held-out" if len(files) >= HELD_OUT_FROM and number == len(files) - 1 else "fit"
        lines += [
            "[[runs]]",
            f"name = {json.dumps(file.stem, ensure_ascii=False)}",
            f'role = "{role}"' + ("  # never fitted: the error on it is the one to believe" if role != "fit" else ""),
            f"file = {json.dumps(str(file.resolve().relative_to(base)), ensure_ascii=False)}",
            "",
        ]
    if len({file.stem for file in files}) < len(files):
        raise MeasuredDataError(f"two logs have the same name, {', '.join(file.stem for file in files)}: rename one")
    return Guessed("\n".join(lines), tuple(told))
