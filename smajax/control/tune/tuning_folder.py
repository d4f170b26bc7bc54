"""A tuning in a folder: its settings, and its state after every round and generation, from which it resumes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from smajax.control.plants import Plants
from smajax.control.presets import CONTROLLERS, code_of_parts
from smajax.control.tune.cma_es import CmaEsState
from smajax.control.tune.cma_es import load as load_evolution
from smajax.control.tune.folder_names import FILES, FINISH, SETTINGS, STATE
from smajax.control.tune.multistart import MultistartState, load
from smajax.control.tune.settings import TuneSettings
from smajax.control.tune.tuning import TuningResult, tune
from smajax.core.files import json_text, replace
from smajax.core.progress import Message, Progress, quiet
from smajax.core.provenance import digest
from smajax.model.system import System


def settings_record(system: System, settings: TuneSettings, plants: Plants | None = None) -> dict[str, Any]:
    """What distinguishes this tuning from another: settings, code and plant. ValueError for settings that make no sense."""
    found = settings.check(system, plants)
    preset = CONTROLLERS[settings.controller]
    plant = preset.plant(system)
    parts = code_of_parts(settings.controller, settings.estimator)
    mark = digest((plant, preset.make(plant)), [*found.marks, parts])[:16]
    return dict(json.loads(json.dumps({**settings.record(), "code": mark})))


def check_folder(out: Path, record: Mapping[str, object]) -> None:
    """ValueError when `out` holds something else than the tuning of this `settings_record`, finished or not."""
    names = sorted(one.name for one in out.iterdir() if not one.name.startswith(".")) if out.is_dir() else []
    other = [name for name in names if name not in FILES]
    if other or (names and SETTINGS not in names):
        raise ValueError(
            f"--out {out} holds something else ({', '.join((other or names)[:3])}): give the name of a new or empty folder."
        )
    if not names:
        return
    try:
        before = json.loads((out / SETTINGS).read_text(encoding="utf-8"))
    except ValueError:
        raise ValueError(f"--out {out}: {SETTINGS} is damaged: give another folder, or --overwrite.") from None
    differ = sorted(name for name in record.keys() | before.keys() if record.get(name) != before.get(name))
    if differ:
        differences = "; ".join(
            f"{name}: {before.get(name)} there, {record.get(name)} requested" for name in differ if name != "code"
        )
        differences = differences or (
            "it was started by another version of smajax, on another plant, or with other code or values of the controller or the filter"
        )
        raise ValueError(f"--out {out} holds another tuning ({differences}): give another folder, or delete that one.")


def tune_in_folder(
    system: System, settings: TuneSettings, out: Path, progress: Progress = quiet, plants: Plants | None = None
) -> TuningResult:
    """Tune, or resume where this tuning was interrupted; its state is in `out`, each file written in one step.

    Raises ValueError for settings that make no sense and for a folder that holds something else, MissingExtraError without a
    package that the settings need.
    """
    record = settings_record(system, settings, plants)
    check_folder(out, record)
    settings.check_packages()
    out.mkdir(parents=True, exist_ok=True)
    replace(out / SETTINGS, json_text(record))

    def save(state: MultistartState | CmaEsState) -> None:
        state.save(out / (STATE if isinstance(state, MultistartState) else FINISH))

    descent, evolution = load(out / STATE), load_evolution(out / FINISH)
    if descent is not None and not descent.ended:
        after = f"round {descent.round}" if descent.round else "the starting points"
        progress(Message(f"resumed after {after}"))
    elif descent is not None and evolution is not None and evolution.generations < settings.finish:
        progress(Message(f"resumed after generation {evolution.generations}"))
    return tune(system, settings, plants=plants, after=descent, known=evolution, save=save, progress=progress)
