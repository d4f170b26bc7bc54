"""The presets of a draft: those that the columns of the logs suggest, and those that are named."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from smajax.core.names import close_matches
from smajax.core.wording import and_listed
from smajax.data.experiment.column_guess import COUPON, DRIVES, GUESS, Column
from smajax.data.model_catalogue import check_together
from smajax.data.readers.table import MeasuredDataError
from smajax.model.presets import DRIVES as DRIVE_PRESETS
from smajax.model.presets import WIRES, build

# Loads whose reading is a position, and the wire of a bench with one.
POSITIONED = {"dead_weight": "flexinol_table_3_2", "bias_spring": "flexinol_ht_500um"}


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


def choose_model(columns: Mapping[str, Column], choice: ModelChoice) -> DraftModel:
    """The presets that the columns (by quantity) suggest; named ones replace them. Raises MeasuredDataError."""
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
    model = replace(model, wire=wire or model.wire, why=_certainty(model.why, choice))
    try:
        check_together(build(model.wire, model.load, model.drive), model.load, model.drive)
    except ValueError as error:
        raise MeasuredDataError(str(error)) from None
    return model


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
    fitting = list(POSITIONED) if guessed.output == "position" else [guessed.load]
    if load not in fitting:
        raise MeasuredDataError(
            f"the load {load!r} does not go with these columns, which have a reading of {guessed.output}: "
            f"{' or '.join(fitting)} does"
        )
    return replace(guessed, wire=POSITIONED[load], load=load, inputs=guessed.inputs[:1])


def _guessed(columns: Mapping[str, Column]) -> DraftModel:
    drive = next((name for name in DRIVES if name in columns), "")
    if not drive and {"temperature", "strain", "stress"} <= columns.keys():
        return DraftModel(
            "flexinol_isobaric", "coupon", "none", COUPON, "strain", "temperature, stress and strain without a drive"
        )
    if "angle" in columns:
        return DraftModel(
            "niti_table_3_1", "arm", drive or "voltage", (drive or "voltage",), "angle", "the output is an angle"
        )
    inputs = (drive or "voltage", *(["mass"] if "mass" in columns else []))
    why = "the output is a position; `--load bias_spring` takes the other load that has one"
    return DraftModel("flexinol_table_3_2", "dead_weight", drive or "voltage", inputs, "position", why)
