"""What wires, loads and drives there are, and the parameters of the chosen three, for the forms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from smajax.app import drawings
from smajax.app.ready import ready
from smajax.data.experiment.schema import ExperimentFile

LIKELY = "of your bench, not measured: about what [priors.presets] says"
# Where a preset's number comes from, in words.
ORIGIN = {"printed": "from the source", "corrected": "from the source, corrected", "chosen": "an assumption"}


@dataclass(frozen=True)
class Card:
    """A preset to choose: its name, what it is, a drawing, and numbers in a few words."""

    name: str
    words: str
    drawing: str
    numbers: str = ""


@dataclass(frozen=True)
class Row:
    """A parameter: unit (SI), the preset's value with its unit, where that comes from, bounds, and the part of the model it belongs to."""

    name: str
    about: str
    unit: str
    preset: str
    origin: str
    low: float
    high: float
    value: float
    part: str  # wire, load or drive
    first: bool  # sizes that a ruler, a balance or a data sheet gives


@lru_cache(maxsize=1)
def cards() -> Mapping[str, tuple[Card, ...]]:
    """By kind: wire, load, drive."""
    ready()
    from smajax.core.parameters import parameter_values
    from smajax.model.presets import DRIVES, LOADS, WIRES

    wires = []
    for name, make in WIRES.items():
        values = parameter_values(make())
        diameter, length = values["wire_diameter"], values["wire_length"]
        numbers = f"{1e3 * diameter:.3g} mm thick, {1e3 * length:.3g} mm long"
        wires.append(Card(name, _first_line(make), drawings.wire(diameter, length), numbers))
    return {
        "wire": tuple(wires),
        "load": tuple(Card(name, *drawings.load(name)) for name in LOADS),
        "drive": tuple(Card(name, _first_line(make), drawings.drive(name)) for name, make in DRIVES.items()),
    }


def _first_line(thing: Any) -> str:
    return (thing.__doc__ or "").strip().partition("\n")[0]


def shown(value: float, unit: str) -> str:
    """As a draft has it: `0.15 mm`."""
    from smajax.data.experiment.draft_parameters import amount

    return amount(value, unit, 5)


@lru_cache(maxsize=16)
def rows(wire: str, load: str, drive: str) -> tuple[Row, ...]:
    """Parameters of the three presets. Raises ValueError for presets that do not go together."""
    ready()
    from smajax.core.parameters import parameter_values, parameters
    from smajax.data.experiment.catalogue import WIRE_SIZES
    from smajax.model.preset_sources import origins_of
    from smajax.model.presets import build

    system = build(wire, load, drive)
    values = parameter_values(system)
    named = {"wire": wire, "load": load, "drive": drive}
    first = {*WIRE_SIZES, "ambient_temperature"}
    found = []
    for name, one in parameters(system).items():
        part = str(one.path[0])
        if part not in named:
            continue  # of the whole, such as the state at the start, which a run or [nuisance] gives
        origin = origins_of(named[part], getattr(system, part)).get(name)
        said = "" if origin is None else f"{ORIGIN[origin.kind]}: {origin.note}"
        found.append(
            Row(
                name=name,
                about=one.about,
                unit=one.unit,
                preset=shown(values[name], one.unit),
                origin=said,
                low=one.low,
                high=one.high,
                value=values[name],
                part=part,
                first=part != "wire" or name in first,
            )
        )
    return tuple(found)


def rows_of(file: ExperimentFile) -> tuple[Row, ...]:
    """Of an experiment file; empty for one of a model file, or of presets that there are not."""
    model = file.model
    if model.file is not None:
        return ()
    try:
        found = rows(model.wire, model.load, model.drive)
    except (KeyError, ValueError):
        return ()
    likely = file.priors.bases
    return tuple(replace(row, preset=likely[row.name], origin=LIKELY) if row.name in likely else row for row in found)


def fresh_bounds(row: Row) -> dict[str, str]:
    """Bounds of a parameter that is to be found, around the preset's value: a factor of two, or 20 K, within what makes sense."""
    wide = 20.0 if row.unit == "degC" else None
    low, high = (row.value - wide, row.value + wide) if wide else sorted((0.5 * row.value, 2.0 * row.value))
    low, high = max(low, row.low), min(high, row.high)
    return {"low": shown(low, row.unit), "high": shown(high, row.unit), "start": shown(row.value, row.unit)}
