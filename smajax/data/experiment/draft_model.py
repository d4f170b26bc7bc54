"""The presets of a draft: those that the columns of the logs suggest, and those that are named."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

from smajax.core.names import close_matches
from smajax.core.plugins import PluginError
from smajax.core.wording import and_listed
from smajax.data.experiment.column_guess import COUPON, DRIVES, GUESS, Column
from smajax.data.model_catalogue import check_together
from smajax.data.readers.table import MeasuredDataError
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.presets import DRIVES as DRIVE_PRESETS
from smajax.model.presets import LOADS, WIRES, build, made_load

# Reading -> the load that is guessed of it, and the wire of a bench with that load or another of the same reading.
GUESSED: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "position": ("dead_weight", "flexinol_table_3_2"),
        "force": ("blocked_wire", "flexinol_table_3_2"),
        "angle": ("arm", "niti_table_3_1"),
    }
)
# By which the diameter of a preset differs from the bench's and its bounds are another wire's: convection goes about as 1/d.
FAR = 2.0
ALIKE = 1e-9  # m: two distances that are the same
OTHER_WIRE: Mapping[str, str] = MappingProxyType({"bias_spring": "flexinol_ht_500um"})  # load -> wire


@dataclass(frozen=True)
class ModelChoice:
    """Names of presets that replace the guesses, "" for none; or the path of a model file, which says all three."""

    load: str = ""
    wire: str = ""
    drive: str = ""
    model: Path | None = None


@dataclass(frozen=True)
class DraftModel:
    wire: str
    load: str
    drive: str
    inputs: tuple[str, ...]
    output: str
    why: str
    wire_why: str = ""  # where a diameter decided


def choose_model(columns: Mapping[str, Column], choice: ModelChoice, diameter: float | None = None) -> DraftModel:
    """The presets that the columns (by quantity) suggest; named ones replace them. Raises MeasuredDataError.

    diameter: of the bench's wire, m, where it is known: of wires that are not named the nearest is taken.
    """
    load, wire, drive = choice.load, choice.wire, choice.drive
    model = _with_load(columns, load)
    for kind, name, known in (("wire", wire, WIRES), ("drive", drive, DRIVE_PRESETS)):
        if name and name not in known:
            raise MeasuredDataError(f"there is no {kind} {name!r}{close_matches(name, known, 'there are')}")
    if drive:
        # What the drive takes stands first; a mass that varies is the load's.
        needed = sorted(DRIVE_PRESETS[drive]().inputs_required)
        others = [name for name in model.inputs if name not in DRIVES]
        model = replace(model, drive=drive, inputs=(*needed, *others))
    if wire:
        model = replace(model, wire=wire)
    elif diameter is not None and model.drive != "none":
        model = _nearest(model, diameter)
    model = replace(model, why=_certainty(model.why, choice))
    try:
        check_together(build(model.wire, model.load, model.drive), model.load, model.drive)
    except ValueError as error:
        raise MeasuredDataError(str(error)) from None
    return model


def _nearest(model: DraftModel, diameter: float) -> DraftModel:
    """With the wire of the presets for benches whose diameter is nearest; of two the first, which is the common, low-temperature one."""
    wires = dict.fromkeys((GUESSED[model.output][1], *OTHER_WIRE.values()))
    own = {name: float(WIRES[name]().wire_diameter) for name in wires}
    wire = min(own, key=lambda name: round(abs(own[name] - diameter) / ALIKE))
    others = {name: abs(size - diameter) for name, size in own.items() if name != wire}
    tie = min(others.values()) - abs(own[wire] - diameter) < ALIKE
    than = and_listed([f"that of {name}, {1e3 * own[name]:g} mm" for name in others])
    why = f"its diameter of {1e3 * own[wire]:g} mm is {'as near' if tie else 'nearer'} to the {1e3 * diameter:.4g} mm given {'as' if tie else 'than'} {than}"
    return replace(model, wire=wire, wire_why=why)


def wire_messages(model: DraftModel, diameter: float | None) -> list[str]:
    """Which wire a diameter (m) decided for, and that a preset's diameter is far from it."""
    chosen = f"wire: {model.wire}, since {model.wire_why} ({GUESS}; --wire takes another)"
    messages = [chosen] if model.wire_why else []
    own = float(WIRES[model.wire]().wire_diameter)
    if diameter is None or model.drive == "none" or max(own / diameter, diameter / own) < FAR:
        return messages
    return [
        *messages,
        f"wire: warning: {model.wire} has a diameter of {1e3 * own:g} mm and yours is {1e3 * diameter:.4g} mm: the bounds under [unknown] are "
        "around the values of another wire and may leave out yours; check them, and take the data sheet's values where you have it",
    ]


def _certainty(why: str, choice: ModelChoice) -> str:
    """`a guess: why`, or which presets were named."""
    named = [kind for kind in ("load", "wire", "drive") if getattr(choice, kind)]
    if not named:
        return f"{GUESS}: {why}"
    return f"as requested: {and_listed(named)}" + (f"; the rest is {GUESS}" if len(named) < 3 else "")


def _with_load(columns: Mapping[str, Column], load: str) -> DraftModel:
    """The presets that the columns suggest, with the named load, and the wire of a bench with it."""
    guessed = _guessed(columns)
    if load in ("", guessed.load):
        return guessed
    readings = [guessed.output, *(name for name in GUESSED if name in columns and name != guessed.output)]
    outputs = {one: name for name in readings for one in loads_with(name)}
    if load not in outputs:
        fitting = list(outputs) or [guessed.load]
        raise MeasuredDataError(
            f"the load {load!r} does not go with these columns, which have a reading of {' and of '.join(readings)}: "
            f"{' or '.join(fitting)} does"
        )
    output = outputs[load]
    wire = OTHER_WIRE.get(load, GUESSED[output][1])
    inputs = (*guessed.inputs[:1], *sorted(made_load(load).inputs_required))
    return replace(guessed, wire=wire, load=load, inputs=inputs, output=output)


def loads_with(reading: str) -> list[str]:
    """The presets of loads that move and whose sensor shows `reading`, one of `GUESSED`, also those of other packages."""
    return [name for name in LOADS if _reading_of(name) == reading]


def _reading_of(name: str) -> str:
    """Empty for a coupon, and for a load of another package that fails: who names it gets the error."""
    try:
        load = made_load(name)
    except PluginError:
        return ""
    return load.reading[0] if isinstance(load, AbstractMovingLoad) else ""


def _guessed(columns: Mapping[str, Column]) -> DraftModel:
    drive = next((name for name in DRIVES if name in columns), "")
    if not drive and {"temperature", "strain", "stress"} <= columns.keys():
        return DraftModel(
            "flexinol_isobaric", "coupon", "none", COUPON, "strain", "temperature, stress and strain without a drive"
        )
    inputs = [drive or "voltage"]
    if "angle" in columns:
        output, why = "angle", "the output is an angle"
    elif "force" in columns and "position" not in columns:
        output, why = "force", "the output is a force and nothing moves: a wire between a frame and a load cell"
    else:
        output, why = "position", "the output is a position"
        inputs += ["mass"] if "mass" in columns else []
    load, wire = GUESSED[output]
    if others := [f"`--load {name}`" for name in loads_with(output) if name != load]:
        why += f"; {' or '.join(others)} takes {'the other' if len(others) == 1 else 'another'} load that has one"
    return DraftModel(wire, load, drive or "voltage", tuple(inputs), output, why)
