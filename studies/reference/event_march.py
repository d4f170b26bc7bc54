"""Integration from event to event: scipy between, a switch of modes at each."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Vector = NDArray[np.float64]
Function = Callable[[float, Vector], float]
MAX_EVENTS = 100_000
MAX_STEP = 1e-2  # s: events are looked for at step ends, so a step must be short against the load's vibration
FINEST_STEP = 1e-5


class Switching(Protocol):
    """A system whose rates are smooth between events; `rates` may return more than the state's own."""

    def rates(self, t: float, s: Vector) -> tuple[float, ...]:
        """Rates of the state, first."""

    def fraction(self, s: Vector) -> float:
        """Martensite fraction in the present mode."""

    def settle(self, t: float, s: Vector) -> Vector:
        """Choose the modes anew after something jumped."""

    def watch(self) -> list[tuple[str, int, Function]]:
        """(name, direction, function) of each event that can end the present mode."""

    def peaks(self) -> list[tuple[int, Function]]:
        """(direction, function) of each turning at which an event may have been stepped over."""

    def passed(self, s: Vector) -> bool:
        """Whether a state at such a turning shows that one was."""

    def handle(self, name: str, t: float, s: Vector) -> Vector:
        """Switch the modes at an event; returns the state after it."""


def march(
    modes: Switching,
    segments: Iterable[tuple[float, Callable[[float, Vector], None]]],
    state: Vector,
    times: Vector,
    atol: Sequence[float] | Vector,
    rtol: float,
    method: str,
) -> Vector:
    """States, and below them the martensite fraction, at `times`.

    `segments`: (end time, what to call at its start with time and state, to set the inputs) in turn.
    """
    size, done, now, count, step = state.size, 0, 0.0, 0, MAX_STEP
    states = np.empty((size + 1, times.size))
    for end, begin in segments:
        begin(now, state)
        state = modes.settle(now, state)
        while now < end:
            count += 1
            if count > MAX_EVENTS:
                raise RuntimeError(
                    f"{MAX_EVENTS} events by t = {now:.6g} s; expected far fewer; "
                    "the modes chatter, so shorten the run or check the parameters"
                )
            watched = modes.watch()
            functions = [_event(function, direction, True) for _, direction, function in watched]
            functions += [_event(function, direction, False) for direction, function in modes.peaks()]
            wanted = times[done : np.searchsorted(times, end, side="right")]
            piece = solve_ivp(
                lambda t, s: modes.rates(t, s)[:size],
                (now, end),
                state,
                method=method,
                max_step=step,
                rtol=rtol,
                atol=atol,
                t_eval=np.append(wanted[wanted < end], end),
                events=functions,
            )
            if piece.status < 0:
                raise RuntimeError(f"integration stopped at t = {now:.6g} s: {piece.message}; loosen rtol")
            if step > FINEST_STEP and any(modes.passed(s) for at in piece.y_events[len(watched) :] for s in at):
                step /= 10  # a contact was passed and left within one step: this piece again, closer
                continue
            step = MAX_STEP
            if len(piece.t):
                got = int(np.searchsorted(wanted, piece.t[-1], side="right"))
                states[:size, done : done + got] = piece.y[:, :got]
                states[size, done : done + got] = [modes.fraction(s) for s in piece.y.T[:got]]
                done += got
            hits = [(at[-1], i) for i, at in enumerate(piece.t_events[: len(watched)]) if at.size]
            if piece.status == 1 and hits:
                now, i = max(hits)
                state = modes.handle(watched[i][0], now, piece.y_events[i][-1].copy())
            else:
                now, state = end, piece.y[:, -1].copy()
    return states


def _event(function: Function, direction: int, terminal: bool) -> Function:
    """A fresh callable with the flags solve_ivp reads."""

    def event(t: float, s: Vector) -> float:
        return function(t, s)

    event.terminal, event.direction = terminal, direction  # type: ignore[attr-defined]
    return event
