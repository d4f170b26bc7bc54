"""The input series that act, from those that were recorded: what effects make of a command, and how late it is."""

from __future__ import annotations

import abc
from collections.abc import Sequence
from typing import ClassVar

from smajax.model.drive.base import AbstractDrive
from smajax.model.types import Inputs, Scalar


class CommandTerm(abc.ABC):
    """What an effect may change in the value of an input."""

    @abc.abstractmethod
    def command(self, channel: str, value: Scalar) -> Scalar:
        """What the drive makes of the `value` recorded on one of its channels, in the channel's unit."""


class InputLagTerm(abc.ABC):
    """What an effect may change in the time of an input. `simulate` heeds it, a closed loop refuses it by name."""

    effect_name: ClassVar[str]

    @abc.abstractmethod
    def input_lag(self, time: Scalar) -> Scalar | float:
        """By how much the drive's input is older at `time` than recorded, s."""


BEFORE, SHARE_BEFORE = "before the switch: ", "share before the switch"


def with_switch(older: Inputs, newer: Inputs, share: Scalar) -> dict[str, Scalar]:
    """The channels of a command that is `older` for the first `share` of a step (0 to 1) and then `newer`, beside other inputs."""
    return {**newer, **{BEFORE + channel: value for channel, value in older.items()}, SHARE_BEFORE: share}


def switched(inputs: Inputs) -> tuple[Scalar, Inputs, Inputs] | None:
    """(share of the step before the switch, inputs before it, inputs after it); None where no input switches within a step."""
    if SHARE_BEFORE not in inputs:
        return None
    older = {name.removeprefix(BEFORE): value for name, value in inputs.items() if name.startswith(BEFORE)}
    after = {name: value for name, value in inputs.items() if name != SHARE_BEFORE and not name.startswith(BEFORE)}
    return inputs[SHARE_BEFORE], {**after, **older}, after


def acting(drive: AbstractDrive, terms: Sequence[CommandTerm], inputs: Inputs) -> Inputs:
    """`inputs` as the drive makes something of them."""
    changed = dict(inputs)
    for term in terms:
        changed |= {channel: term.command(channel, changed[channel]) for channel in drive.inputs_required}
    return changed
