"""What several logs hold together: the columns of each kind of file, and which files make a run."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import TypeAlias

from smajax.data.experiment.column_guess import COUPON, DRIVES, GUESS, SURE, TIME, Column, columns_of
from smajax.data.experiment.grouping import RunFiles, paired
from smajax.data.readers.table import MeasuredDataError, NoColumnError, Table

Requested: TypeAlias = Mapping[str | int, tuple[str, str]]


@dataclass(frozen=True)
class Logs:
    """What the files hold: columns of every kind of file, each with the kind that has it, and the runs."""

    columns: tuple[tuple[Column, int], ...]  # each quantity once
    kinds: tuple[Table, ...]  # a file of each kind
    runs: tuple[RunFiles, ...]
    own: tuple[
        Mapping[str, Column], ...
    ] = ()  # of each file: quantity -> its column, where the first file's is not in it


def _as_requested(seen: Sequence[Column], requested: Requested) -> list[Column]:
    """The guesses with those columns as requested; a quantity that was guessed for another column is that one's no longer."""
    wanted = {quantity for quantity, _ in requested.values() if quantity}
    result = []
    for one in seen:
        if one.key in requested:
            quantity, unit = requested[one.key]
            one = replace(one, quantity=quantity, unit=unit, sure=SURE, why="as requested")
        elif one.quantity in wanted:
            one = replace(one, quantity="", why=f"another column is the {one.quantity}, as requested")
        result.append(one)
    return result


def logs_of(files: Sequence[Path], tables: Sequence[Table], requested: Requested = MappingProxyType({})) -> Logs:
    """One run a file where a file has an input and an output, else one file a sensor. Raises MeasuredDataError.

    requested: column, as an experiment file names it -> its quantity ("" for none) and unit, in the place of the guess.
    """
    seen = [_as_requested(columns_of(table), requested) for table in tables]
    quantities = [frozenset(one.quantity for one in columns) - {"", TIME} for columns in seen]
    kinds = list(dict.fromkeys(quantities))
    if len(kinds) == 1 or any(_is_whole(held, frozenset().union(*quantities)) for held in quantities):
        runs = tuple(RunFiles(file.stem, (file,)) for file in files)
        own = tuple(
            _otherwise(table, seen[0], columns) if table is not tables[0] else {}
            for table, columns in zip(tables, seen, strict=True)
        )
        return Logs(tuple((one, 0) for one in seen[0]), (tables[0],), runs, own)
    groups = [[k for k, held in enumerate(quantities) if held == kind] for kind in kinds]
    runs = paired([[files[k] for k in several] for several in groups])
    columns: list[tuple[Column, int]] = []
    for kind, several in enumerate(groups):
        for one in seen[several[0]]:
            rival = next((other for other, _ in columns if one.quantity and other.quantity == one.quantity), None)
            if rival is not None and one.quantity != TIME:
                one = replace(one, quantity="", sure=GUESS, why=f"{rival.name!r} is taken for the {one.quantity}")
            elif rival is not None and (rival.key, rival.unit) != (one.key, one.unit):
                raise MeasuredDataError(
                    f"{files[several[0]]}: its time is {one.name!r} in {one.unit}, that of {files[groups[0][0]].name} is "
                    f"{rival.name!r} in {rival.unit}; an experiment has one name for both: rename one"
                )
            if rival is None or one.quantity != TIME:
                columns.append((one, kind))
    return Logs(tuple(columns), tuple(tables[several[0]] for several in groups), runs)


def _otherwise(table: Table, usual: Sequence[Column], own: Sequence[Column]) -> dict[str, Column]:
    """Quantity -> the column that this log has for it, where the usual one is not in it. Raises NoColumnError where it has none."""
    result = {}
    for one in usual:
        try:
            if one.quantity:
                table.name_of(one.key)
        except NoColumnError:
            other = next((other for other in own if other.quantity == one.quantity), None)
            if other is None:
                raise
            result[one.quantity] = other
    return result


def _is_whole(quantities: Collection[str], every: Collection[str]) -> bool:
    """Whether these are an input and an output of some model; of all that the files have, a force is one where nothing moves."""
    outputs = {"position", "angle"} & set(every) or {"force"}
    moves = outputs & set(quantities) and set(DRIVES) & set(quantities)
    return bool(moves) or {*COUPON, "strain"} <= set(quantities)
