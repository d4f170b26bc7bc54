"""The results of a tuning in its folder: gains, page, pictures and numbers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from smajax.control.gains_file import write_gains
from smajax.control.plants import Plants
from smajax.control.tune.folder_names import GAINS, RECORD, RESULTS
from smajax.control.tune.settings import TuneSettings
from smajax.control.tune.tuning import TuningResult
from smajax.control.tune.tuning_folder import check_folder, settings_record
from smajax.core.files import json_text, replace
from smajax.core.provenance import made_with
from smajax.model.system import System
from smajax.report.next_steps import ARM, PlantWords, after_tune
from smajax.report.tune_page import loops, page, record
from smajax.report.tune_pictures import before_after, costs_over_loops


def finished(system: System, settings: TuneSettings, out: Path, plants: Plants | None = None) -> dict[str, Any] | None:
    """The record of this very tuning, where `out` has all of its results; None otherwise.

    Raises ValueError as `tune_in_folder` does.
    """
    check_folder(out, settings_record(system, settings, plants))
    if not all((out / name).is_file() for name in RESULTS):
        return None
    try:
        known, gains = (json.loads((out / name).read_text(encoding="utf-8")) for name in (RECORD, GAINS))
        same = {name: one["after"] for name, one in known["gains"].items()} == {
            name: one["value"] for name, one in gains["gains"].items()
        }
    except (AttributeError, KeyError, TypeError, ValueError):
        return None
    return known if same else None


def write_tuning(tuned: TuningResult, out: Path, command: str = "", plant: PlantWords = ARM) -> dict[str, Any]:
    """Write the results into the folder, each file in one step; the record of `tune.json`. plant: as the commands that the page suggests name it."""
    origin = {"tuned": tuned.settings.record(), "command": command, **made_with()}
    write_gains(out / GAINS, tuned.after, tuned.units, origin)
    pictures = {"before_after.png": before_after(tuned), "descent.png": costs_over_loops(tuned)}
    for name, png in pictures.items():
        replace(out / name, png)
    whole = {**record(tuned, command), "model": plant.model}
    replace(out / RECORD, json_text(whole))
    replace(out / "loops.csv", loops(tuned))
    settings = tuned.settings
    steps = after_tune(out, plant, GAINS, settings.set_points, settings.shown.shown, settings.seconds)
    replace(out / "tune.html", page(tuned, pictures, command, steps))
    return whole
