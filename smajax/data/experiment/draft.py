"""An experiment file begun from measured logs: what can be guessed filled in, what cannot as a comment."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from smajax.core.names import instead
from smajax.core.parameters import parameter_values, parameters
from smajax.core.units import convert
from smajax.core.wording import and_listed
from smajax.data.experiment.column_guess import (
    COUPON,
    DRIVES,
    GUESS,
    LIKELY,
    SURE,
    TIME,
    Column,
    time_unit_of,
    times_not_read,
)
from smajax.data.experiment.logs import logs_of
from smajax.data.experiment.model_description import WIRE_SIZES
from smajax.data.model_catalogue import check_together
from smajax.data.readers.read import read_table
from smajax.data.readers.table import MeasuredDataError, Table
from smajax.model.presets import DRIVES as DRIVE_PRESETS
from smajax.model.presets import WIRES, build
from smajax.model.system import System

MOST_SAMPLES = 2000  # of the longest run on the clock
# Loads whose reading is a position, and the wire of a bench with one.
POSITIONED = {"dead_weight": "flexinol_table_3_2", "bias_spring": "flexinol_ht_500um"}
HELD_OUT_FROM = 3  # runs from which on the last one is held out
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


def _model(found: dict[str, Column], load: str = "", wire: str = "", drive: str = "") -> _Model:
    """The presets that the columns speak for; those that are named in the place of guessed ones. Raises MeasuredDataError."""
    model = _loaded(found, load)
    for kind, name, known in (("wire", wire, WIRES), ("drive", drive, DRIVE_PRESETS)):
        if name and name not in known:
            raise MeasuredDataError(f"there is no {kind} {name!r}{instead(name, known, 'there are')}")
    if drive:
        # What the drive takes stands first; a mass that varies is the load's.
        needed = sorted(DRIVE_PRESETS[drive]().inputs_required)
        others = [name for name in model.inputs if name not in DRIVES]
        model = replace(model, drive=drive, inputs=(*needed, *others))
    model = replace(model, wire=wire or model.wire, why=_how_sure(model.why, load, wire, drive))
    try:
        check_together(build(model.wire, model.load, model.drive), model.load, model.drive)
    except ValueError as error:
        raise MeasuredDataError(str(error)) from None
    return model


def _how_sure(why: str, load: str, wire: str, drive: str) -> str:
    """`a guess: why`, but for the presets that were named."""
    named = [kind for kind, name in (("load", load), ("wire", wire), ("drive", drive)) if name]
    if not named:
        return f"{GUESS}: {why}"
    return f"as asked for: {and_listed(named)}" + (f"; the rest is {GUESS}" if len(named) < 3 else "")


def _loaded(found: dict[str, Column], load: str) -> _Model:
    """The presets that the columns speak for, with the load that is named, and the wire of a bench with it."""
    guessed = _guessed(found)
    if load in ("", guessed.load):
        return guessed
    fitting = list(POSITIONED) if guessed.output == "position" else [guessed.load]
    if load not in fitting:
        raise MeasuredDataError(
            f"the load {load!r} does not go with these columns, which have a reading of {guessed.output}: "
            f"{' or '.join(fitting)} does"
        )
    return replace(guessed, wire=POSITIONED[load], load=load, inputs=guessed.inputs[:1])


def _guessed(found: dict[str, Column]) -> _Model:
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
    why = "the output is a position; `--load bias_spring` takes the other load that has one"
    return _Model("flexinol_table_3_2", "dead_weight", drive or "voltage", inputs, "position", why)


def _key(column: Column, variable: bool) -> str:
    word = "variable" if variable else "column"
    return f"{word} = {json.dumps(column.key, ensure_ascii=False)}"


def _channel(name: str, role: str, column: Column, variable: bool, off: bool) -> list[str]:
    lines = [
        f"[channels.{name}]  # {column.sure}: {column.why}",
        f'role = "{role}"',
        _key(column, variable),
        f"unit = {json.dumps(column.unit, ensure_ascii=False)}",
    ]
    if role == "output":
        lines.append('noise = "estimate"  # or its sigma, such as "0.01 mm"')
        lines += [] if off else ["# reversed = true  # where the sensor counts the other way: down when the wire pulls"]
    return [f"# {line}" if off else line for line in lines]


def _own_lines(own: Mapping[str, Column], usual: Mapping[str, Column]) -> list[str]:
    """What a run says of columns that its log calls otherwise."""
    if not own:
        return []
    columns = ", ".join(f"{name} = {json.dumps(one.key, ensure_ascii=False)}" for name, one in own.items())
    units = ", ".join(
        f"{name} = {json.dumps(one.unit, ensure_ascii=False)}"
        for name, one in own.items()
        if one.unit != usual[name].unit
    )
    sure = max((one.sure for one in own.values()), key=[SURE, LIKELY, GUESS].index)
    return [
        f"columns = {{ {columns} }}  # {sure}: this log calls them otherwise",
        *([f"units = {{ {units} }}"] if units else []),
    ]


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


def _amount(value: float, unit: str, places: int) -> str:
    return f"{value:.{places}g} {unit.replace('-', '')}".strip()


def _known(model: _Model, system: System) -> dict[str, tuple[str, str]]:
    """What a ruler, a balance or a data sheet tells of the bench: name -> (the preset's value, what it is)."""
    table, values = parameters(system), parameter_values(system)
    heated, given = model.drive != "none", {"load_mass"} if "mass" in model.inputs else set()
    sizes = [*WIRE_SIZES, *["ambient_temperature"] * heated] if model.load != "coupon" else []
    names = [*sizes, *(name for name, one in table.items() if one.path[0] in ("load", "drive") and name not in given)]
    return {name: (_amount(values[name], table[name].unit, 4), table[name].about) for name in names}


def _unknowns(model: _Model, system: System) -> list[str]:
    """The parameters that no sheet tells, with bounds around the preset's."""
    table, values = parameters(system), parameter_values(system)
    heated = model.drive != "none"
    lines = []
    for name, (low, high) in FACTORS.items():
        if not heated and name != "recoverable_strain":
            continue
        value = values[name]
        box = (max(low * value, table[name].low), min(high * value, table[name].high), value)
        shown = [_amount(one, table[name].unit, 3) for one in box]
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


def begun(
    files: Sequence[Path],
    target: Path,
    title: str = "",
    load: str = "",
    wire: str = "",
    drive: str = "",
    decimal: str = "",
) -> Guessed:
    """The experiment file `target` for these logs. Raises MeasuredDataError for a file that cannot be read.

    load, wire, drive: names of presets, in the place of those that the columns speak for. decimal: "," or ".", where the files do not
    tell which one it is.
    A file is a run, with the columns of the first one; another file without one of them has its own for the same quantity, or
    is refused by name. Where no file has an input and an output, a run is one file of each kind, by their names.
    """
    tables = [read_table(file, decimal=decimal or None) for file in files]
    logs = logs_of(files, tables)
    columns = [one for one, _ in logs.columns]
    found = {one.quantity: one for one in columns if one.quantity}
    model = _model(found, load, wire, drive)
    kind_of = {one.quantity: kind for one, kind in logs.columns if one.quantity}
    variable = {quantity: bool(logs.kinds[kind].clocks) for quantity, kind in kind_of.items()}
    told = [f"{one.name}: {one.quantity} in {one.unit} ({one.sure}: {one.why})" for one in columns if one.quantity]
    told += [f"{one.name}: left out ({one.why})" for one in columns if not one.quantity]
    for table in logs.kinds:
        told += [f"{name}: left out ({why.split('; expected')[0]})" for name, why in table.unusable.items()]
    for file, own in zip(files, logs.own, strict=False):
        told += [f"{file.name}: {one.name}: {name} in {one.unit} ({one.sure}: {one.why})" for name, one in own.items()]
    told.append(f"model: {model.wire}, {model.load}, {model.drive} ({model.why}; `smajax presets` has the others)")
    if len(logs.kinds) > 1:
        told.append(
            f"runs: {'; '.join(f'{run.name} of {and_listed([file.name for file in run.files])}' for run in logs.runs)} ({GUESS}: by their names)"
        )
    missing = [name for name in (*model.inputs, model.output) if name not in found]
    folder = _folder(files, target)
    lines = [
        f'# Begun by `smajax new-experiment`. Lines that say "{GUESS}" or "{LIKELY}" want a look; "{SURE}" ones come from',
        "# headings with units. What the model can be: `smajax presets`; what may be fitted: the page 'Parameters of the presets'",
        "# of the documentation, and the parameters of `smajax effects`.",
        f"title = {json.dumps(title or target.stem, ensure_ascii=False)}",
        "",
        f"[model]  # {model.why}",
        f'wire = "{model.wire}"',
        f'load = "{model.load}"',
        f'drive = "{model.drive}"',
        "",
        "[model.parameters]  # what is known of your bench, each with its unit; the rest is the preset's",
    ]
    preset = build(model.wire, model.load, model.drive)
    known = _known(model, preset)
    lines += [f'# {name} = "{value}"  # {about}' for name, (value, about) in known.items()]
    if known:
        some = ", ".join(f"{name} {value}" for name, (value, _) in list(known.items())[:4])
        told.append(
            f"the bench: the preset's {some}{' and others' if len(known) > 4 else ''} until [model.parameters] has yours; a "
            "wrong one shows up as a wrong fitted value"
        )
    lines += [
        "",
        f"[unknown]  # to be fitted: bounds around the values of {model.wire}, and where the search starts; for another wire",
        "# begin again with `--wire NAME --overwrite`, or move them",
    ]
    lines += [
        *_unknowns(model, preset),
        "",
        "[nuisance]",
        "offset = true  # the sensor's zero may move from run to run",
        "",
    ]
    own_of = dict(zip(files, logs.own, strict=True)) if logs.own else {}
    clocks = [
        clock
        for file, table in zip(files, tables, strict=True)
        if (clock := _clock(table, [*own_of.get(file, {}).values(), *columns])) is not None
    ]
    if clocks and len(clocks) < len(tables):
        raise MeasuredDataError("some of the files have a time and others have none; give all of them one")
    if not clocks:
        wrong = next(((table, *one) for table in tables for one in times_not_read(table).items()), None)
        if wrong is not None:
            table, name, why = wrong
            lines += [
                f"[time]  # NOT READ: {why}",
                f"column = {json.dumps(name, ensure_ascii=False)}",
                f'unit = "{time_unit_of(table, name)}"',
                "",
                f"[sampling]  # {GUESS}",
                'step = "50 ms"',
                "",
            ]
            told.insert(
                0,
                f"time: NOT READ: {why}. Repair that and begin again; or write kind = 'sample' in the place of all under [time], "
                "and leave [sampling] out, where samples are to be counted",
            )
        else:
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
        periods = [float(np.median(np.diff(clock))) for clock in clocks]
        usual = max(periods)
        step = _round(max(usual, max(float(np.ptp(clock)) for clock in clocks) / MOST_SAMPLES))
        irregular = any(np.ptp(np.diff(clock)) > 0.5 * period for clock, period in zip(clocks, periods, strict=True))
        lines += ["[sampling]  # the clock that all signals are brought to", f'step = "{1e3 * step:g} ms"', ""]
        told.append(
            f"sampling: every {usual:.4g} s{', irregular' if irregular else ''}; the fit takes {step:g} s ({LIKELY})"
        )
    used = {TIME, *model.inputs, model.output}
    for name in model.inputs:
        if name in found:
            lines += [*_channel(name, "input", found[name], variable[name], False), ""]
    if model.output in found:
        lines += [*_channel(model.output, "output", found[model.output], variable[model.output], False), ""]
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
            *_channel(one.quantity, role, one, variable[one.quantity], True),
            "",
        ]
    held_out = logs.runs[-1] if len(logs.runs) >= HELD_OUT_FROM else None
    if held_out is not None:
        told.append(f"held out: the last run, {held_out.name}; another one by its `role` in [[runs]]")
    lines += ["[data]", f"folder = {json.dumps(str(folder), ensure_ascii=False)}"]
    mark = f'decimal = "{decimal or ","}"  # what stands before the decimals of a number'
    lines += [mark if decimal else f"# {mark}, where no number shows it: 1,234 may be a thousand", ""]
    base = (target.resolve().parent / folder).resolve()
    used_here = [name for name in (*model.inputs, model.output) if name in found]
    for run in logs.runs:
        role = "held-out" if run is held_out else "fit"
        inside = [json.dumps(str(file.resolve().relative_to(base)), ensure_ascii=False) for file in run.files]
        by_channel = ", ".join(f"{name} = {inside[kind_of[name]]}" for name in used_here)
        lines += [
            "[[runs]]",
            f"name = {json.dumps(run.name, ensure_ascii=False)}",
            f'role = "{role}"' + ("  # never fitted: the error on it is the one to believe" if role != "fit" else ""),
            f"file = {inside[0]}" if len(inside) == 1 else f"files = {{ {by_channel} }}",
            *_own_lines({name: one for name, one in own_of.get(run.files[0], {}).items() if name in used}, found),
            "",
        ]
    if len({run.name for run in logs.runs}) < len(logs.runs):
        raise MeasuredDataError(f"two logs have the same name, {', '.join(run.name for run in logs.runs)}: rename one")
    return Guessed("\n".join(lines), tuple(told))
