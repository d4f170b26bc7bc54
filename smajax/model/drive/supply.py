"""Electrical power in the wire (I^2 R of eq. 3.1): what the drive gives, less what its supply loses before the wire."""

from __future__ import annotations

import abc
from typing import NamedTuple

import jax.numpy as jnp

from smajax.model.drive.base import AbstractDrive
from smajax.model.drive.inputs import CommandTerm, acting
from smajax.model.types import Inputs, Scalar, WireState

# V: less than this heats nothing. A quotient by its square, which a derivative takes, would have no number.
NO_VOLTAGE = 1e-9


class Circuit(NamedTuple):
    """What the supply is asked for, by the drive and by the effects before in the order of the effects."""

    voltage: Scalar  # while it is on, V
    peak_current: Scalar | float  # while it is on and nothing is lost, A
    current: Scalar  # the mean, A
    per_volt: Scalar  # by how much the mean current falls per volt lost, A/V


class SeriesTerm(abc.ABC):
    """Something in series with the wire."""

    @abc.abstractmethod
    def series_resistance(self) -> Scalar | float:
        """Resistance between the supply and the wire, ohm."""


class SupplyTerm(abc.ABC):
    """A supply whose voltage depends on what it gives, now or of late (then it is a `wire.history.HistoryTerm` as well)."""

    @abc.abstractmethod
    def voltage_share(self, circuit: Circuit, old: WireState | None) -> Scalar | float:
        """Share of its voltage that is left at the end of a step from `old`, -; None: a rested supply."""

    def history_after_supply(self, circuit: Circuit, old: WireState) -> dict[str, Scalar]:
        """Its entries of `WireState.history` after such a step, those that `history_after` leaves alone."""
        return {}


class SupplyTerms(NamedTuple):
    """All that effects change between the inputs and the power in the wire."""

    commands: tuple[CommandTerm, ...] = ()
    series: tuple[SeriesTerm, ...] = ()
    supplies: tuple[SupplyTerm, ...] = ()


def heating_power(
    drive: AbstractDrive,
    terms: SupplyTerms,
    wire_length: Scalar,
    resistance: Scalar,
    inputs: Inputs,
    old: WireState | None,
) -> Scalar:
    """Electrical power in each metre of wire, W/m; `resistance` is the wire's, ohm/m, `wire_length` in m.

    `old`: the wire before the step, for a supply that depends on what it gave; None: a rested one.
    """
    return _supplied(drive, terms, wire_length, resistance, inputs, old)[0]


def history_after_supply(
    drive: AbstractDrive,
    terms: SupplyTerms,
    wire_length: Scalar,
    resistance: Scalar,
    inputs: Inputs,
    old: WireState,
) -> dict[str, Scalar]:
    """Entries of `WireState.history` of the supply after a step from `old` that ends with the wire at `resistance`."""
    _, circuits = _supplied(drive, terms, wire_length, resistance, inputs, old)
    history: dict[str, Scalar] = {}
    for term, circuit in zip(terms.supplies, circuits, strict=True):
        history |= term.history_after_supply(circuit, old)
    return history


def _supplied(
    drive: AbstractDrive,
    terms: SupplyTerms,
    wire_length: Scalar,
    resistance: Scalar,
    inputs: Inputs,
    old: WireState | None,
) -> tuple[Scalar, list[Circuit]]:
    """(power in each metre of wire, what each supply term was asked for)."""
    inputs = acting(drive, terms.commands, inputs)
    power = drive.power(resistance, wire_length, inputs)
    series = sum(term.series_resistance() for term in terms.series)
    if terms.series:
        power = power * drive.wire_share(resistance * wire_length, series)
    circuits = []
    for term in terms.supplies:
        circuits.append(_circuit(drive, resistance * wire_length + series, resistance, power, inputs))
        power = power * term.voltage_share(circuits[-1], old) ** 2
    return power, circuits


def _circuit(drive: AbstractDrive, whole: Scalar, resistance: Scalar, power: Scalar, inputs: Inputs) -> Circuit:
    """At `power` per metre of a wire of `resistance` per metre in a circuit of `whole` ohm."""
    peak = drive.drawn_current(whole, inputs)
    voltage = peak * whole
    on = voltage > NO_VOLTAGE
    # The wire's power is that of pulses of voltage / whole, for the share of the time that they last.
    current = jnp.where(on, power * whole / (jnp.where(on, voltage, 1.0) * resistance), 0.0)
    return Circuit(voltage, peak, current, current / jnp.where(on, voltage, 1.0))
