"""The lines of a draft that name a channel: its column, its role and its unit."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from smajax.data.experiment.column_guess import GUESS, LIKELY, SURE, Column
from smajax.data.experiment.schema import noise_example
from smajax.data.experiment.toml_file import toml_value


class Said(NamedTuple):
    """What a draft says of a column."""

    comment: str  # above its section, before its name
    message: str  # on the terminal, behind its name


# Of columns that the model need not have, by quantity or role.
NOT_NEEDED: Mapping[str, Said] = MappingProxyType(
    {
        "output": Said(
            "A further output, where it is of this wire",
            "a further output, a comment in the draft: remove the # where it is of this wire",
        ),
        "input": Said("Not used by this model", "an input that this model does not take, a comment in the draft"),
        "ambient_temperature": Said(
            "The temperature of the air, where it changes",
            "the temperature of the air, a comment in the draft: remove the # where it changes from run to run or within a run",
        ),
    }
)
ABSOLUTE = ("temperature", "resistance")  # whose zero nobody sets from run to run, as that of a position


def _key(column: Column, variable: bool) -> str:
    word = "variable" if variable else "column"
    return f"{word} = {toml_value(column.key)}"


def channel_lines(name: str, role: str, column: Column, variable: bool, off: bool, gaps: bool) -> list[str]:
    """A section of a channel, as comments where it is `off`. gaps: whether samples are missing, which an output may lack."""
    lines = [
        f"[channels.{name}]  # {column.sure}: {column.why}",
        f'role = "{role}"',
        _key(column, variable),
        f"unit = {toml_value(column.unit)}",
    ]
    if role == "output":
        lines += ['missing = "skip"  # empty cells are omitted'] if gaps else []
        lines.append(f'noise = "estimate"  # or its sigma, such as "{noise_example(column.unit)}"')
        if name in ABSOLUTE:
            lines.append(
                "offset = false  # what the sensor shows is true as it is: a zero of each run would hide what the model lacks"
            )
        lines += [] if off else ["# reversed = true  # where the sensor counts the other way: down when the wire pulls"]
    return [f"# {line}" if off else line for line in lines]


def override_lines(overrides: Mapping[str, Column], usual: Mapping[str, Column]) -> list[str]:
    """Columns and units of a run whose log has other names for them."""
    if not overrides:
        return []
    columns = ", ".join(f"{name} = {toml_value(one.key)}" for name, one in overrides.items())
    units = ", ".join(
        f"{name} = {toml_value(one.unit)}" for name, one in overrides.items() if one.unit != usual[name].unit
    )
    sure = max((one.sure for one in overrides.values()), key=[SURE, LIKELY, GUESS].index)
    return [
        f"columns = {{ {columns} }}  # {sure}: this log has other names for them",
        *([f"units = {{ {units} }}"] if units else []),
    ]
