"""A draft of an experiment file from measured logs: guesses filled in, the rest as comments."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from smajax.core.units import convert
from smajax.core.wording import and_listed
from smajax.data.experiment.column_guess import (
    GUESS,
    LIKELY,
    SURE,
    TIME,
    Column,
    time_unit_of,
    times_not_read,
)
from smajax.data.experiment.draft_channels import NOT_NEEDED, channel_lines, override_lines
from smajax.data.experiment.draft_facts import PAYLOAD, BenchFacts, Known, diameter_of, facts_of
from smajax.data.experiment.draft_model import DraftModel, ModelChoice, choose_model, wire_messages
from smajax.data.experiment.draft_parameters import PresetLine, begun_at, kept_parameters, ordered, preset_parameters
from smajax.data.experiment.first_force import first_force
from smajax.data.experiment.grouping import RunFiles
from smajax.data.experiment.logs import Logs, Requested, logs_of
from smajax.data.experiment.sample_rates import UNEVEN, clock_step, rates_messages
from smajax.data.experiment.toml_file import toml_value
from smajax.data.model_file.read import load_model
from smajax.data.readers.read import read_table
from smajax.data.readers.table import MeasuredDataError, Table

HELD_OUT_FROM = 3  # runs from which on the last one is held out
ROLES = '# Runs of role "fit" are fitted; those of role "held-out" are not: the error on them validates the model.'


@dataclass(frozen=True)
class Draft:
    """The text of the file, a message for each guess in it, with its certainty, and the values in it that are the preset's.

    of_bench: those of the messages that are of the model, its values and the runs' roles, and not of what the logs hold.
    """

    text: str
    messages: tuple[str, ...]
    presets: tuple[PresetLine, ...] = ()
    of_bench: tuple[str, ...] = ()

    def begun_at(self, starts: Mapping[str, str]) -> Draft:
        """With other starts of unknowns, by name, each with its unit."""
        return replace(self, text=begun_at(self.text, starts))

    def in_order(self, remarks: Mapping[str, str]) -> Draft:
        """With the values that are the preset's in the order of `remarks`, by name, each with its own beside it."""
        return replace(self, text=ordered(self.text, self.presets, remarks))


def _clock(table: Table, columns: Sequence[Column]) -> np.ndarray | None:
    """Times of the file in seconds, by its own clock or its time column."""
    if table.clocks:
        return np.asarray(next(iter(table.clocks.values())))
    time = next((one for one in columns if one.quantity == TIME), None)
    return None if time is None else convert(table.columns[time.name], time.unit, "s")


def _folder(files: Sequence[Path], target: Path) -> Path:
    common = Path(os.path.commonpath([file.resolve().parent for file in files]))
    return Path(os.path.relpath(common, target.resolve().parent))


def draft(
    files: Sequence[Path],
    target: Path,
    title: str = "",
    choice: ModelChoice | None = None,
    decimal: str = "",
    bench: BenchFacts | None = None,
    columns: Requested = MappingProxyType({}),
) -> Draft:
    """The experiment file `target` for these logs. Raises MeasuredDataError for a file that cannot be read.

    columns: column -> (quantity, unit) in the place of the guess, see `logs_of`.
    decimal: the decimal mark, "," or ".", where the files do not determine it. bench: what is known of it; ExperimentError where that
    cannot be, as of the file.
    A file is a run, with the columns of the first one; another file without one of them has its own for the same quantity, or
    is refused by name. Where no file has an input and an output, a run is one file of each kind, by their names.
    """
    choice = choice or ModelChoice()
    kept = None if choice.model is None else load_model(choice.model)
    if kept is not None:
        choice = replace(choice, load=kept.load, wire=kept.wire, drive=kept.drive)
    tables = [read_table(file, decimal=decimal or None).with_gaps() for file in files]
    logs = logs_of(files, tables, columns)
    by_quantity = {one.quantity: one for one, _ in logs.columns if one.quantity}
    kind_of = {one.quantity: kind for one, kind in logs.columns if one.quantity}
    bench = bench or BenchFacts()
    diameter = diameter_of(bench)
    model = choose_model(by_quantity, choice, diameter)
    known, hint = facts_of(bench, target, model, kept, [run.name for run in logs.runs])
    inputs = _Inputs(tuple(files), tuple(tables), logs, by_quantity, kind_of, model, known)
    time = _time(inputs)
    own = preset_parameters(model, known) if kept is None else kept_parameters(model, kept, known)
    of_own = [*([] if kept else wire_messages(model, diameter)), *own.messages, *hint]
    sections = [
        _head(inputs, title or _title(inputs), "" if kept is None else _relative(choice, target)),
        _Section(own.lines, of_own, of_bench=of_own),
        time,
        _channels(inputs),
        _data(inputs, target, decimal),
        _runs(inputs, target),
    ]
    names = [run.name for run in logs.runs]
    if len(set(names)) < len(names):
        raise MeasuredDataError(f"two logs have the same name, {', '.join(names)}: rename one")
    first = time.messages if time.first else ()
    rest = [message for one in sections for message in one.messages if not (one is time and time.first)]
    of_bench = tuple(message for one in sections for message in one.of_bench)
    return Draft("\n".join(line for one in sections for line in one.lines), (*first, *rest), own.presets, of_bench)


@dataclass(frozen=True)
class _Inputs:
    """The logs, their columns by quantity with the kind of file that has each, and the model."""

    files: tuple[Path, ...]
    tables: tuple[Table, ...]
    logs: Logs
    columns: Mapping[str, Column]
    kind_of: Mapping[str, int]
    model: DraftModel
    known: Known

    def is_variable(self, quantity: str) -> bool:
        """Whether a file names it a variable: a signal with its own times."""
        return bool(self.logs.kinds[self.kind_of[quantity]].clocks)

    def has_gaps(self, quantity: str) -> bool:
        """Whether any log lacks samples of it."""
        files = [run.files[self.kind_of[quantity]] for run in self.logs.runs]
        return any(
            self.tables[self.files.index(file)].has_gaps(self.overrides(file).get(quantity, self.columns[quantity]).key)
            for file in files
        )

    @property
    def first_forces(self) -> Mapping[str, float]:
        """Run -> what the load cell of a blocked wire shows at its start, N; empty of another load, and of a cell set to zero there."""
        if self.model.output != "force" or "force" not in self.columns:
            return {}
        found = {}
        for run in self.logs.runs:
            force, unit = self._signal(run, "force")
            drive = self.model.inputs[0]
            same = drive in self.columns and self.kind_of[drive] == self.kind_of["force"]
            value = first_force(force, unit, self._signal(run, drive)[0] if same else None)
            if value is None:
                return {}
            found[run.name] = value
        return found

    def _signal(self, run: RunFiles, quantity: str) -> tuple[np.ndarray, str]:
        """A channel of a run as logged, and its unit."""
        file = run.files[self.kind_of[quantity]]
        column = self.overrides(file).get(quantity, self.columns[quantity])
        table = self.tables[self.files.index(file)]
        return table.columns[table.name_of(column.key)], column.unit

    def overrides(self, file: Path) -> Mapping[str, Column]:
        """Quantity -> the column of this file, where it differs from the first file's."""
        return dict(zip(self.files, self.logs.own, strict=True)).get(file, {}) if self.logs.own else {}


@dataclass(frozen=True)
class _Section:
    """Lines of the file, and messages about its guesses; `first`: messages that are printed before all others."""

    lines: Sequence[str]
    messages: Sequence[str] = ()
    first: bool = False
    of_bench: Sequence[str] = ()  # those of the messages that are of no log


def _relative(choice: ModelChoice, target: Path) -> str:
    """The path of the model file, as the experiment file `target` says it."""
    assert choice.model is not None
    return Path(os.path.relpath(choice.model.resolve(), target.resolve().parent)).as_posix()


def _title(inputs: _Inputs) -> str:
    """What the bench is, and where its runs are from: "3 runs of wire_2: flexinol_table_3_2, dead_weight, voltage"."""
    model, runs = inputs.model, inputs.logs.runs
    folder = Path(os.path.commonpath([file.resolve().parent for file in inputs.files])).name
    of = f" of {folder}" if folder else ""
    which = runs[0].name if len(runs) == 1 else f"{len(runs)} runs{of}"
    return f"{which}: {model.wire}, {model.load}, {model.drive}"


def _head(inputs: _Inputs, title: str, model_file: str = "") -> _Section:
    """Title and model, presets or a file; a message for every column, the model, and the files of each run."""
    logs, model = inputs.logs, inputs.model
    columns = [one for one, _ in logs.columns]
    messages = [f"{one.name}: {one.quantity} in {one.unit} ({one.sure}: {one.why})" for one in columns if one.quantity]
    messages += [f"{one.name}: left out ({one.why})" for one in columns if not one.quantity]
    for table in logs.kinds:
        messages += [f"{name}: left out ({why.split('; expected')[0]})" for name, why in table.unusable.items()]
    for file, overrides in zip(inputs.files, logs.own, strict=False):
        messages += [
            f"{file.name}: {one.name}: {name} in {one.unit} ({one.sure}: {one.why})" for name, one in overrides.items()
        ]
    presets = f"{model.wire}, {model.load}, {model.drive} ({model.why}; `smajax presets` has the others)"
    whose = f"model: {f'that of {model_file}' if model_file else presets}"
    messages.append(whose)
    if len(logs.kinds) > 1:
        runs = "; ".join(f"{run.name} of {and_listed([file.name for file in run.files])}" for run in logs.runs)
        messages.append(f"runs: {runs} ({GUESS}: by their names)")
    lines = [
        f'# A draft by `smajax new-experiment`. Check the lines that say "{GUESS}" or "{LIKELY}"; "{SURE}" ones come from',
        "# headings with units. Possible models: `smajax presets`; parameters that may be fitted: the page 'Parameters of the presets'",
        "# of the documentation, and the parameters of `smajax effects`.",
        f"title = {toml_value(title)}",
        "",
        *(
            ["[model]", f"file = {toml_value(model_file)}", ""]
            if model_file
            else [
                f"[model]  # {model.why}",
                f'wire = "{model.wire}"' + (f"  # {model.wire_why}" if model.wire_why else ""),
                f'load = "{model.load}"',
                f'drive = "{model.drive}"',
                "",
            ]
        ),
    ]
    return _Section(lines, messages, of_bench=[whose])


def _time(inputs: _Inputs) -> _Section:
    """[time] and [sampling]. Raises MeasuredDataError where some of the files have a time and others none."""
    every = [one for one, _ in inputs.logs.columns]
    clocks = [
        clock
        for file, table in zip(inputs.files, inputs.tables, strict=True)
        if (clock := _clock(table, [*inputs.overrides(file).values(), *every])) is not None
    ]
    if not clocks:
        return _no_time(inputs.tables, heated=inputs.model.drive != "none")
    if len(clocks) < len(inputs.tables):
        raise MeasuredDataError("some of the files have a time and others have none; give all of them one")
    lines: list[str] = []
    if TIME in inputs.columns:
        time = inputs.columns[TIME]
        lines += [
            f"[time]  # {time.sure}: {time.why}",
            f"column = {toml_value(time.key)}",
            f'unit = "{time.unit}"',
            "",
        ]
    periods = [float(np.median(np.diff(clock))) for clock in clocks]
    usual = max(periods)
    spread = max(
        float(np.ptp(np.diff(clock))) / max(period, 1e-300) for clock, period in zip(clocks, periods, strict=True)
    )
    step, why = clock_step(usual, max(float(np.ptp(clock)) for clock in clocks), spread)
    lines += [
        f"[sampling]  # the clock to which all signals are resampled: {why}",
        f'step = "{1e3 * step:.6g} ms"',
        "",
    ]
    message = f"sampling: every {usual:.4g} s{', irregular' if spread > UNEVEN else ''}; the clock of the fit: {step:.4g} s, {why} ({LIKELY})"
    return _Section(lines, [message, *rates_messages([file.name for file in inputs.files], periods)])


def _no_time(tables: Sequence[Table], heated: bool) -> _Section:
    """No column is a time: samples are counted, or a column that should be one is named with what is wrong."""
    wrong = next(((table, *one) for table in tables for one in times_not_read(table).items()), None)
    if wrong is None:
        lines = ["[time]  # no column is a time: samples are counted", 'kind = "sample"', ""]
        why = "of a heated wire it has to be given" if heated else "where it is known"
        lines += [
            "# [sampling]",
            f'# step = "{50 if heated else 1000} ms"  # the time from one sample to the next: {why}',
            "",
        ]
        todo = "; write the time from one sample to the next as step under [sampling]" if heated else ""
        return _Section(lines, [f"time: none found, samples are counted ({GUESS}){todo}"], first=heated)
    table, name, why = wrong
    lines = [
        f"[time]  # NOT READ: {why}",
        f"column = {toml_value(name)}",
        f'unit = "{time_unit_of(table, name)}"',
        "",
        f"[sampling]  # {GUESS}",
        'step = "50 ms"',
        "",
    ]
    message = (
        f"time: NOT READ: {why}. Repair that and draft again; or write kind = 'sample' in place of all under [time], "
        "and the time from one sample to the next as step under [sampling], where samples are to be counted"
    )
    return _Section(lines, [message], first=True)


def _channels(inputs: _Inputs) -> _Section:
    """[channels.*]: those of the model, those that are missing, and the others as comments."""
    model, columns = inputs.model, inputs.columns
    roles = {**dict.fromkeys(model.inputs, "input"), model.output: "output"}
    lines: list[str] = []
    messages: list[str] = []
    for name, role in roles.items():
        if name in columns:
            gaps = inputs.has_gaps(name)
            lines += [*channel_lines(name, role, columns[name], inputs.is_variable(name), False, gaps), ""]
            if gaps and role == "input":
                messages.append(
                    f"{name}: some of its cells are empty, and the model needs every sample of an input: fill them"
                )
            elif gaps:
                messages.append(f'{name}: some of its cells are empty: these samples are omitted (missing = "skip")')
    for name, role in roles.items():
        if name not in columns:
            lines += [
                f"# {name}: no column was found for this {role}, which the model needs. Complete:",
                f"# [channels.{name}]",
                f'# role = "{role}"',
                '# column = "?"',
                '# unit = "?"',
                "",
            ]
            messages.append(f"{name}: MISSING, an {role} that the model needs")
    sensors = {"temperature", "stress", "force", "strain", "resistance", "position", "angle"}
    for one, _ in inputs.logs.columns:
        if one.quantity and one.quantity not in {TIME, *roles}:
            role = "output" if one.quantity in sensors else "input"
            said = NOT_NEEDED.get(one.quantity, NOT_NEEDED[role])
            lines += [
                f"# {said.comment}: {one.name}",
                *channel_lines(
                    one.quantity, role, one, inputs.is_variable(one.quantity), True, inputs.has_gaps(one.quantity)
                ),
                "",
            ]
            messages.append(f"{one.name}: {said.message}")
    return _Section(lines, messages)


def _data(inputs: _Inputs, target: Path, decimal: str) -> _Section:
    """[data]: the folder and the decimal mark."""
    folder = toml_value(str(_folder(inputs.files, target)))
    mark = f'decimal = "{decimal or ","}"  # the decimal mark'
    hint = mark if decimal else f"# {mark}, where no number determines it: 1,234 may be a thousand"
    return _Section(["[data]", f"folder = {folder}", hint, ""])


def _runs(inputs: _Inputs, target: Path) -> _Section:
    """[[runs]]; from `HELD_OUT_FROM` runs on the last one is held out."""
    model, runs = inputs.model, inputs.logs.runs
    held_out = runs[-1] if len(runs) >= HELD_OUT_FROM else None
    base = (target.resolve().parent / _folder(inputs.files, target)).resolve()
    channels = {*model.inputs, model.output}
    lines: list[str] = []
    forces, masses, payloads = inputs.first_forces, inputs.known.masses, inputs.known.payloads
    for run in runs:
        role = "held-out" if run is held_out else "fit"
        names = [toml_value(file.resolve().relative_to(base).as_posix()) for file in run.files]
        by_channel = ", ".join(
            f"{name} = {names[inputs.kind_of[name]]}"
            for name in (*model.inputs, model.output)
            if name in inputs.columns
        )
        overrides = inputs.overrides(run.files[0])
        lines += [
            "[[runs]]",
            *([ROLES] if run is runs[0] else []),  # within the table, where an edit of the file leaves it
            f"name = {toml_value(run.name)}",
            f'role = "{role}"',
            *(
                [f'parameters = {{ pretension = "{forces[run.name]:.4g} N" }}  # {GUESS}: what the force begins with']
                if forces
                else []
            ),
            *([f"inputs = {{ mass = {toml_value(masses[run.name])} }}"] if masses else []),
            *([f"parameters = {{ {PAYLOAD} = {toml_value(payloads[run.name])} }}"] if run.name in payloads else []),
            f"file = {names[0]}" if len(names) == 1 else f"files = {{ {by_channel} }}",
            *override_lines(
                {name: one for name, one in overrides.items() if name in {TIME, *channels}}, inputs.columns
            ),
            "",
        ]
    messages = [f"pretension: what the force of each run begins with ({GUESS})"] if forces else []
    if held_out is None:
        return _Section(lines, messages)
    few = len(runs) == HELD_OUT_FROM
    others = f"the other {len(runs) - 1}; " + ("a fourth log would be a third fit run; " if few else "")
    role = f"held out: the last run, {held_out.name}, to validate the fit of {others}choose another one by its `role` in [[runs]]"
    return _Section(lines, [*messages, role], of_bench=[role])
