"""A tuning in a folder: its state after every round, and in the end gains, page, pictures and numbers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from smajax.control.gains_file import write_gains
from smajax.control.presets import CONTROLLERS
from smajax.control.tune.cma_es import Evolution
from smajax.control.tune.cma_es import load as load_evolution
from smajax.control.tune.multistart import Descent, load
from smajax.control.tune.settings import TuneSettings
from smajax.control.tune.tuning import Tuned, tune
from smajax.core.files import json_text, replace
from smajax.core.progress import Message, Progress, quiet
from smajax.core.provenance import digest, made_with
from smajax.model.system import System
from smajax.report.tune_page import loops, page, record
from smajax.report.tune_pictures import before_after, costs_over_loops

ASKED, STATE, FINISH, GAINS, TOLD = "asked.json", "state.npz", "finish.npz", "gains.json", "tune.json"
OURS = {ASKED, STATE, FINISH, GAINS, TOLD, "tune.html", "loops.csv", "before_after.png", "descent.png"}


def check_folder(out: Path, asked: dict[str, object]) -> None:
    """ValueError when `out` holds something else than this tuning, finished or not."""
    found = sorted(one.name for one in out.iterdir() if not one.name.startswith(".")) if out.is_dir() else []
    other = [name for name in found if name not in OURS]
    if other or (found and ASKED not in found):
        raise ValueError(
            f"--out {out} holds something else ({', '.join((other or found)[:3])}): give the name of a new or empty folder."
        )
    if not found:
        return
    try:
        before = json.loads((out / ASKED).read_text(encoding="utf-8"))
    except ValueError:
        raise ValueError(f"--out {out}: {ASKED} is damaged: give another folder, or --overwrite.") from None
    differ = sorted(name for name in asked.keys() | before.keys() if asked.get(name) != before.get(name))
    if differ:
        told = "; ".join(
            f"{name}: {before.get(name)} there, {asked.get(name)} asked" for name in differ if name != "code"
        )
        told = told or "it was begun by another version of smajax or on another plant"
        raise ValueError(f"--out {out} holds another tuning ({told}): give another folder, or delete that one.")


def _asked(system: System, settings: TuneSettings) -> dict[str, Any]:
    """What tells this tuning from another: settings, code and plant. ValueError for settings that make no sense."""
    settings.check(system)
    mark = digest(CONTROLLERS[settings.controller].plant(system))[:16]
    return dict(json.loads(json.dumps({**settings.record(), "code": mark})))


def ended(system: System, settings: TuneSettings, out: Path) -> dict[str, Any] | None:
    """The record of this very tuning, where `out` holds it whole; None where something is to be done.

    Raises ValueError as `tune_into` does.
    """
    check_folder(out, _asked(system, settings))
    if not all((out / name).is_file() for name in OURS - {STATE, FINISH}):
        return None
    try:
        told, gains = (json.loads((out / name).read_text(encoding="utf-8")) for name in (TOLD, GAINS))
        same = {name: one["after"] for name, one in told["gains"].items()} == {
            name: one["value"] for name, one in gains["gains"].items()
        }
    except (AttributeError, KeyError, TypeError, ValueError):
        return None
    return told if same else None


def tune_into(
    system: System, settings: TuneSettings, out: Path, command: str = "", progress: Progress = quiet
) -> Tuned:
    """Tune, or go on where this tuning was interrupted, and write the folder, each file in one step.

    Raises ValueError for settings that make no sense and for a folder that holds something else, MissingExtraError without a
    package that the settings need.
    """
    asked = _asked(system, settings)
    check_folder(out, asked)
    settings.check_packages()
    out.mkdir(parents=True, exist_ok=True)
    replace(out / ASKED, json_text(asked))

    def keep(state: Descent | Evolution) -> None:
        state.save(out / (STATE if isinstance(state, Descent) else FINISH))

    after, known = load(out / STATE), load_evolution(out / FINISH)
    if after is not None and not after.ended:
        progress(Message(f"going on after round {after.round}" if after.round else "going on from the starts"))
    elif after is not None and known is not None and known.generations < settings.finish:
        progress(Message(f"going on after generation {known.generations}"))
    found = tune(system, settings, after=after, known=known, keep=keep, progress=progress)
    told = {"tuned": settings.record(), "command": command, **made_with()}
    write_gains(out / GAINS, found.after, found.units, told)
    pictures = {"before_after.png": before_after(found), "descent.png": costs_over_loops(found)}
    for name, png in pictures.items():
        replace(out / name, png)
    replace(out / TOLD, json_text(record(found, command)))
    replace(out / "loops.csv", loops(found))
    replace(out / "tune.html", page(found, pictures, command))
    return found
