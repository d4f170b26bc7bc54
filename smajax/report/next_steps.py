"""What a reader of a page may do next: commands with the names of the files that the page was written with.

A command runs in the folder in which that of the page ran. `RUN` stands for a log that the page cannot know.
"""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from smajax.attribution.findings import Findings
from smajax.control.position_unit import unit_of
from smajax.control.presets import CONTROLLERS, controllers_for
from smajax.control.run_result import RunResult
from smajax.control.scales import seconds_for
from smajax.core.display_units import digits
from smajax.core.operating_system import as_typed
from smajax.data.experiment.draft_model import GUESSED, loads_with
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.data.model_file.its_experiment import experiment_of_model
from smajax.fit.experiment_check import ExperimentCheck
from smajax.fit.identify_result import Identified
from smajax.model.system import System
from smajax.report.check_words import warnings

RUN = "another_run.csv"
RUNS = ("first_run.csv", "second_run.csv", "third_run.csv")
MODEL = "model.toml"
PREFERRED = "pid"  # where the load can have it
MOVED = 0.02  # of the stroke: a run that moved the load by less says no set point
TO_PREDICT = "Predict a run that the model was not fitted to"
TO_TUNE = "Tune a controller on it"
TO_REFIT = "Fit the model again, to other runs"
TO_EXPORT = "Take it to Simulink"


class Step(NamedTuple):
    """what: in words, without a colon. command: to be copied. files: beside the page, to be downloaded. python: a line of it."""

    what: str
    command: str = ""
    files: tuple[str, ...] = ()
    python: str = ""


@dataclass(frozen=True)
class PlantWords:
    """How a command names its plant, as typed; nothing: the arm of the source."""

    parts: tuple[str, str, str] | None = None  # presets of wire, load and drive
    law: str = ""
    model: str = ""
    values: tuple[str, ...] = ()
    other: str = ""  # the model file of --plant

    def of_simulate(self) -> list[str]:
        """The presets are arguments there."""
        return [*(self.parts or ()), *self._rest(), *(("--plant", self.other) if self.other else ())]

    def assumed(self) -> list[str]:
        """Options of tune, sweep and export for the plant that the controller assumes."""
        names = zip(("--wire", "--load", "--drive"), self.parts or (), strict=False)
        return [word for pair in names for word in pair] + self._rest()

    def options(self) -> list[str]:
        """Of tune and sweep, with the plant of the closed loops where that is another."""
        return [*self.assumed(), *(("--plant", self.other) if self.other else ())]

    def of_experiment(self) -> list[str]:
        """Options of new-experiment, which takes no coupon; the arm is what it guesses of an angle."""
        if self.model:
            return ["--model", self.model]
        if not self.parts or self.law or self.values:
            return []
        guessed = self.parts[1] == GUESSED["angle"][0]
        return [] if guessed or not any(self.parts[1] in loads_with(one) for one in GUESSED) else self.assumed()

    def _rest(self) -> list[str]:
        law = ("--law", self.law) if self.law else ()
        model = ("--model", self.model) if self.model else ()
        return [*law, *model, *(word for one in self.values for word in ("--set", one))]


ARM = PlantWords()


def command(*words: str | Path) -> str:
    """A line for the shell."""
    return as_typed(["smajax", *map(str, words)])


def section(steps: Sequence[Step]) -> str:
    """The part of a page; nothing for none."""
    if not steps:
        return ""
    items = []
    for one in steps:
        links = ", ".join(f'<a href="{html.escape(name)}" download>{html.escape(name)}</a>' for name in one.files)
        line = one.command or one.python
        code = f"<code class=line>{html.escape(line)}</code>" if line else ""
        items.append(f"<li>{html.escape(one.what)}: {links}{code}</li>")
    where = "<p class=quiet>Commands run in the folder where that of this page ran.</p>"
    return f"<h2>What next</h2><ul class=steps>{''.join(items)}</ul>{where * any(one.command for one in steps)}"


def controller_of(system: System) -> str:
    """The first controller to try on a plant; "" where none works on it."""
    if not CONTROLLERS[PREFERRED].missing(system):
        return PREFERRED
    return next(iter(controllers_for(system)), "")


def _tuning(model: Path, system: System) -> list[Step]:
    name = controller_of(system)
    return [Step(TO_TUNE, command("tune", name, "--model", model, "--out", "tuned"))] if name else []


def after_close_loop(findings: Findings, folder: Path, experiment: str) -> list[Step]:
    """Nothing where no model was fitted. experiment: path of its file."""
    extended = findings.extended_model
    if extended is None:
        return []
    model = folder / MODEL
    base = () if extended is findings.base_model else ("base_model.toml",)
    resumed = command("close-loop", experiment, "--out", folder)
    return [
        *([Step("Go on with this loop, from the fits that are finished", resumed)] if findings.remaining else []),
        Step(
            f"Download the model of this page{', and the base model' if base else ''}", files=(MODEL, "model.nc", *base)
        ),
        Step(TO_PREDICT, command("predict", model, RUN, "--out", "predicted")),
        Step(
            "Design the run that would determine most",
            command("identify", experiment, "--design", "--out", "identified"),
        ),
        *_tuning(model, extended.system),
        Step(TO_REFIT, command("new-experiment", RUN, "--model", model, "--out", "again.toml")),
        Step(TO_EXPORT, command("export", model, "--to", "fmu", "--out", "actuator.fmu")),
        _in_python(model),
    ]


def _in_python(model: Path) -> Step:
    return Step("Use it in Python", python=f"import smajax as sma; model = sma.load_model({model.as_posix()!r}).system")


def after_check(found: ExperimentCheck, experiment: str) -> list[Step]:
    """experiment: path of its file."""
    again = Step("After a change of the file, check it again", command("check", experiment))
    fit = Step("Fit the unknowns", command("identify", experiment, "--out", "identified"))
    search = Step("Find what the model lacks", command("close-loop", experiment, "--out", "report"))
    return [*[again] * bool(warnings(found)), *[fit] * bool(found.unknowns), search]


def after_identify(result: Identified, folder: Path, experiment: str) -> list[Step]:
    """experiment: path of its file."""
    model, steps = folder / MODEL, []
    if result.model is not None:
        steps.append(Step("Download the model of this page", files=(MODEL, "model.nc")))
    steps.append(Step("Find what the model lacks", command("close-loop", experiment, "--out", "report")))
    if result.model is not None:
        steps.append(Step(TO_PREDICT, command("predict", model, RUN, "--out", "predicted")))
    if not result.suggestions:
        presets = ("--presets", "fitted") if result.fitted_presets else ()
        design = command("identify", experiment, *presets, "--design", "--out", folder)
        steps.append(Step("Design the run that would determine most", design))
    if result.model is not None:
        steps += [*_tuning(model, result.model.system), _in_python(model)]
    return steps


def after_predict(model: ActuatorModel, path: str, logs: Sequence[str]) -> list[Step]:
    """path: of the model file. logs: of the runs that were predicted, or an experiment file."""
    own = not any(log.endswith(".toml") or Path(log).is_dir() for log in logs)
    steps = _again(model, path, logs) if own else []
    return [
        *steps,
        *_tuning(Path(path), model.system),
        Step(TO_EXPORT, command("export", path, "--to", "fmu", "--out", "actuator.fmu")),
        _in_python(Path(path)),
    ]


def _again(model: ActuatorModel, path: str, logs: Sequence[str]) -> list[Step]:
    """A fit to these logs and to the runs of before, whose experiment file is looked for; where it is not there, from the model that they left."""
    found = experiment_of_model(model, Path(path))
    if found is None:
        again = command("new-experiment", *logs, "--model", path, "--out", "again.toml")
        what = "fit the model again, to these runs, with its values and their errors in the place of the runs of before"
        return [Step(f"Where the error is too large, {what}", again)]
    experiment, known = found
    new = [log for log in logs if Path(log).resolve() not in known]
    if not new:
        return []
    extended = command(
        "new-experiment", *new, "--with-runs-of", experiment, "--out", experiment.with_name("again.toml")
    )
    return [Step("Where the error is too large, fit the model again, to the runs of before and these", extended)]


def after_simulate(result: RunResult, plant: PlantWords, gains: str = "") -> list[Step]:
    """gains: the file of them that a closed loop was run with."""
    if result.controller is not None:
        name = str(result.data.attrs["controller"])
        return _after_loop(name, plant, gains)
    name = controller_of(result.system)
    fit = Step(
        "Fit this model to measured runs",
        command("new-experiment", *RUNS, *plant.of_experiment(), "--out", "experiment.toml"),
    )
    if not name:
        return [fit]
    unit = unit_of(result.system)
    position = unit.of(result.data["position"].to_numpy())
    steps = []
    if position.max() - position.min() > MOVED * abs(position).max():
        target = (
            f"{digits(float(0.5 * (position.min() + position.max())), 2)}{unit.shown}:{seconds_for(result.system):g}s"
        )
        loop = ("--controller", name, "--set-point", target, "--out", "loop")
        steps.append(Step("Let a controller lead it", command("simulate", *plant.of_simulate(), *loop)))
    return [*steps, Step("Tune that controller", command("tune", name, *plant.options(), "--out", "tuned")), fit]


def _after_loop(name: str, plant: PlantWords, gains: str) -> list[Step]:
    given = ("--gains", gains) if gains else ("--controllers", name)
    steps = [Step("Try it on perturbed plants", command("sweep", *given, *plant.options(), "--out", "sweep"))]
    if gains:
        return [*steps, _to_c(gains, plant)]
    return [*steps, Step("Tune its gains", command("tune", name, *plant.options(), "--out", "tuned"))]


def _to_c(gains: str | Path, plant: PlantWords) -> Step:
    return Step(
        "Take it to a microcontroller, as C99",
        command("export", gains, "--to", "c", *plant.assumed(), "--out", "controller"),
    )


def after_tune(
    folder: Path, plant: PlantWords, name: str, set_points: Sequence[float], unit: str, seconds: float
) -> list[Step]:
    """name: the file of the gains in the folder. set_points, unit: of the tuning. seconds: of a closed loop."""
    gains = folder / name
    points = dict.fromkeys((max(set_points), min(set_points)))
    moves = ",".join(f"{one:g}{unit}:{seconds:g}s" for one in points)
    return [
        Step("Download the gains", files=(name,)),
        Step("Try them on perturbed plants", command("sweep", "--gains", gains, *plant.options(), "--out", "sweep")),
        Step(
            "One loop over time",
            command("simulate", *plant.of_simulate(), "--gains", gains, "--set-point", moves, "--out", "loop"),
        ),
        _to_c(gains, plant),
    ]


def after_sweep(
    folder: Path,
    plant: PlantWords,
    best: str,
    set_points: Sequence[float],
    unit: str,
    gains: str = "",
    mismatch: str = "",
) -> list[Step]:
    """best: the controller to go on with. gains: its file, where it has one. mismatch: the plant of a batch that it bears worst."""
    target = f"{sorted(set_points)[len(set_points) // 2]:g}{unit}:10s"
    given = ("--gains", gains) if gains else ("--controller", best)
    steps = [
        Step(
            f"One loop of {best} over time",
            command("simulate", *plant.of_simulate(), *given, "--set-point", target, "--out", "loop"),
        )
    ]
    if mismatch:
        own = command(
            "simulate", *plant.of_simulate(), *given, "--set-point", target, "--mismatch", mismatch, "--out", "worst"
        )
        steps.append(Step("The same on the plant that it bears worst", own))
    steps.append(
        _to_c(gains, plant)
        if gains
        else Step(f"Tune {best}", command("tune", best, *plant.options(), "--out", "tuned"))
    )
    numbers = (folder / "sweep.nc").as_posix()
    return [
        *steps,
        Step("Every closed loop, in Python", python=f"import xarray; loops = xarray.open_dataset({numbers!r})"),
    ]


def after_reports(folder: Path, reports: Sequence[str]) -> list[Step]:
    """reports: the folders of those that have a model, from `folder`, the best first."""
    steps = []
    if reports:
        model = folder / reports[0] / MODEL
        steps = [
            Step(TO_PREDICT, command("predict", model, RUN, "--out", "predicted")),
            Step(TO_TUNE, command("tune", PREFERRED, "--model", model, "--out", "tuned")),
        ]
    return [*steps, Step("This page again, with reports that were added", command("reports", folder))]


def after_figures() -> list[Step]:
    """From the source's model to the reader's own runs."""
    return [
        Step(
            "Run the model of these figures with inputs of your own",
            command("simulate", "--step", "7.4V:6s,0V:6s", "--out", "simulated"),
        ),
        Step("Compare its controllers", command("sweep", "--controllers", "pid,sld", "--fast", "--out", "sweep")),
        Step(
            "Begin with measured runs of your own",
            command("new-experiment", *RUNS, "--out", "experiment.toml"),
        ),
    ]
