"""M16: the amplitudes xi_M and xi_A, carried and renewed at reversals, corrected and as printed (eq. 3.26)."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from smajax.model.rigs import coupon
from smajax.model.system import System
from smajax.model.wire.branch_amplitude import AbstractRenewal, AsPrinted, Corrected
from smajax.report.drawing import BLUE, GREEN, RED, keyed, named, panels

from .rigs import Recorded, simulated
from .row import Result, Row

STRESS = 100e6  # Pa: A_s' = 82.5, A_f' = 92.5, M_s' = 66.5, M_f' = 56.5
# Heat half way, rest, heat to the end, cool half way, heat half way, cool again, heat to the end, cool to the end.
TURNS = (23.0, 87.0, 87.0, 110.0, 61.0, 86.0, 62.0, 110.0, 23.0)
RESUMED, AGAIN = 3, 7  # turns at which heating has gone through the whole range


def _renewing(renewal: AbstractRenewal) -> System:
    system = coupon()
    kinetics = dataclasses.replace(system.wire.kinetics, renewal=renewal)
    return dataclasses.replace(system, wire=dataclasses.replace(system.wire, kinetics=kinetics))


def work(fast: bool) -> Result:
    """One path of partial loops under both rules, and the corrected rule without the pause."""
    each = 400 if fast else 4000

    def driven(renewal: AbstractRenewal, turns: tuple[float, ...]) -> Recorded:
        temperature = np.interp(np.arange(each * (len(turns) - 1) + 1) / each, np.arange(len(turns)), turns)
        inputs = {"temperature": jnp.asarray(temperature), "stress": jnp.full(len(temperature), STRESS)}
        return simulated(_renewing(renewal), inputs, 1.0)

    ours, printed = driven(Corrected(), TURNS), driven(AsPrinted(), TURNS)
    unpaused = driven(Corrected(), (TURNS[0], *TURNS[2:]))
    step = float(np.abs(np.diff(ours.martensite_fraction)).max())
    steepest = 0.5 * np.pi / 10.0 * float(np.abs(np.diff(ours.temperature)).max())
    complete = float(max(ours.martensite_fraction[turn * each] for turn in (RESUMED, AGAIN)))
    left = float(printed.martensite_fraction[RESUMED * each])
    paused = float(np.abs(ours.martensite_fraction[2 * each :] - unpaused.martensite_fraction[each:]).max())

    def draw(figure: Figure) -> None:
        loop, rule = panels(figure, 1, 2)
        loop.plot(printed.temperature, printed.martensite_fraction, color=RED, linewidth=1, label="as printed")
        loop.plot(ours.temperature, ours.martensite_fraction, color=BLUE, label="corrected")
        loop.set_xlim(50.0, 112.0)
        keyed(loop)
        named(loop, "temperature (°C)", "martensite fraction")
        sample = np.arange(len(ours.temperature)) / each
        rule.plot(sample, ours.martensite_fraction, color=BLUE, label="xi")
        rule.plot(sample, np.clip(ours.xi_M, 0.0, 2.0), "--", color=RED, label="xi_M")
        rule.plot(sample, ours.xi_A, "-.", color=GREEN, label="xi_A")
        rule.set_ylim(-0.05, 1.3)
        keyed(rule)
        named(rule, "turn of the path", "fraction, amplitudes", "corrected")

    return Result(
        holds=float(ours.xi_M[0]) == 1.0
        and float(ours.xi_A[0]) == 0.0
        and step < 1.01 * steepest
        and complete == 0.0
        and abs(float(ours.martensite_fraction[-1]) - 1.0) < 1e-12
        and paused < 1e-12
        and left > 0.05,
        found=f"xi_M = 1, xi_A = 0 at the start; corrected: xi has no jump, the resumed heating ends at {complete:.0f}, a "
        f"pause changes nothing ({paused:.0e}); as printed the same heating ends at xi = {left:.2f} above A_f'",
        numbers={
            "start_xi_M": float(ours.xi_M[0]),
            "start_xi_A": float(ours.xi_A[0]),
            "largest_step_of_fraction": step,
            "end_of_resumed_heating": complete,
            "end_of_resumed_heating_as_printed": left,
            "change_by_a_pause": paused,
        },
        draw=draw,
        caveat="the default is the corrected rule; the printed one is `AsPrinted` in wire/renewal.py.",
    )


ROW = Row(
    "M16", "eq. 3.26, sec. 3.7", "wire", "xi_M = 1 and xi_A = 0 initially, both carried and renewed at reversals", work
)
