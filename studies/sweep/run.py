"""`python -m studies.sweep.run`: the sweeps of this folder (some fifteen minutes; `--fast`: few plants, printed and not stored).

Every controller with the gains of `studies.requirement`, where it has some, on the filter `adaptive` with 0.1 deg of noise, readings in steps of 0.1 deg and
commands 10 ms late. `--true-state`: without all of these, printed and not stored. `--cache FOLDER`: finished controllers are read from there.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from smajax.control.gains_file import read_gains
from smajax.control.sweep.run_sweep import TRUE_STATE, SweepSettings, begun_sweep, sweep_controllers, sweep_settings_for
from smajax.core.files import replace
from smajax.core.progress import Event, Message
from smajax.core.runtime import prepare
from smajax.model.rigs import arm
from smajax.report.sweep_folder import as_text, write_sweep
from smajax.report.sweep_page import answer
from studies.requirement.run import COMPARED, GAINS

HERE = Path(__file__).parent
COMMAND = "python -m studies.sweep.run"
AT_MAIN_GAIN = {"gain_ratios": (1.0,)}
# Folder -> what differs from the defaults of `smajax sweep`.
SWEEPS: dict[str, dict[str, Any]] = {
    ".": {},
    "near": {"ratio_range": (0.9, 1.1), **AT_MAIN_GAIN},
    "inertia": {"first": "inertia", "second": "ambient", **AT_MAIN_GAIN},
}
FAST = {"points": 3, "set_points": (-20.0, 20.0, 60.0), "seconds": 6.0, **AT_MAIN_GAIN}


def settings_of(folder: str, **changed: Any) -> SweepSettings:
    """Of one of `SWEEPS`; changed: further fields."""
    system = arm()
    tuned = tuple(read_gains(path, system) for path in sorted(GAINS.glob("*.json")))
    return sweep_settings_for(system, COMPARED, tuned=tuned, **{**SWEEPS[folder], **changed})


def _said(event: Event) -> None:
    if isinstance(event, Message):
        print(event, flush=True)


def main(arguments: list[str]) -> None:
    """Run the sweeps, and store record and pictures where they are of the whole grid."""
    prepare(cores=True)
    changed = {**(FAST if "--fast" in arguments else {}), **(TRUE_STATE if "--true-state" in arguments else {})}
    if "--cache" in arguments:
        _run(changed, Path(arguments[arguments.index("--cache") + 1]))
        return
    with tempfile.TemporaryDirectory() as cache:
        _run(changed, Path(cache))


def _run(changed: dict[str, Any], cache: Path) -> None:
    """changed: what differs from the settings of the study; with something the results are printed alone."""
    for folder in SWEEPS:
        settings, work, out = settings_of(folder, **changed), cache / folder, HERE / folder
        sweeps = sweep_controllers(arm(), settings, work, _said)
        results = write_sweep(begun_sweep(arm(), settings), sweeps, work, _said, COMMAND)
        print(answer(results), as_text(results), sep="\n", flush=True)
        if changed:
            continue
        out.mkdir(exist_ok=True)
        replace(out / "sweep.json", (work / "sweep.json").read_text(encoding="utf-8"))
        for picture in work.glob("*.png" if folder == "." else "*_maps.png"):
            shutil.copyfile(picture, out / picture.name)


if __name__ == "__main__":
    main(sys.argv[1:])
