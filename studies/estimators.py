"""The filters against each other, and what was chosen for the presets: `python -m studies.estimators [--fast]`.

The arm under 8 V for 3 s, then 0 V, simulated in steps of 5 ms and read every 10 ms. Errors are root mean squares over
the runs of several noise seeds, up to where the arm lands on its lower stop, and around the turn at the top apart.

Three questions: which R the printed filter needs (none is printed) and what dropping the last sample but one from its
Jacobian costs; how large the random walks of the filter over the simulator's step must be for what it believes wrongly;
and where points in the place of a derivative (unscented) are better.
"""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from smajax.control.estimators.printed_filter import PastCarried, PastDropped
from smajax.control.estimators.run import estimate
from smajax.control.estimators.unscented import Unscented
from smajax.control.presets import model_filter, printed_filter
from smajax.core.parameters import get_parameters, set_parameters
from smajax.model.rigs import arm
from smajax.model.system import System
from smajax.report.drawing import BLUE, GREEN, GREY, RED, keyed, named, panels
from studies.source.rigs import recorded, simulated

PICTURE = Path(__file__).parent / "estimators.png"
PERIOD, STEP, SECONDS, NOISE = 0.01, 0.005, 5.0, 1e-3
SHOWN = {
    "position": (180.0 / np.pi, "deg"),
    "velocity": (1.0, "rad/s"),
    "stress": (1e-6, "MPa"),
    "temperature": (1.0, "C"),
    "martensite_fraction": (1.0, "-"),
}
READING_VARIANCES = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
WALKS = (0.1, 0.3, 1.0, 3.0, 10.0)  # times the preset's
# What the plant is while the filter believes in the preset.
PLANTS: dict[str, dict[str, float]] = {
    "as believed": {},
    "h_c + 10 %": {"convection_coefficient": 165.0},
    "ambient + 3 C": {"ambient_temperature": 23.0},
    "payload + 5 %": {"payload_mass": 0.05719 * 1.05},
    "A_s, A_f - 2 C": {"austenite_start": 66.0, "austenite_finish": 76.0},
}
STARTS = {"15 C too warm": 35.0, "15 C too cold": 5.0}


class Record(eqx.Module):
    """A true run at the filter's samples, and its readings with noise, one row a seed."""

    true: Any
    readings: Any
    volts: Any


def record(system: System, seeds: int) -> Record:
    """Simulate the run and read it."""
    volts = np.where(np.arange(round(SECONDS / STEP) + 1) < round(3.0 / STEP), 8.0, 0.0)
    every = round(PERIOD / STEP)
    true = jax.tree.map(lambda series: series[::every], simulated(system, {"voltage": jnp.asarray(volts)}, STEP))
    drawn = np.random.default_rng(1).standard_normal((seeds, true.position.size))
    return Record(true, jnp.asarray(true.position + NOISE * drawn), jnp.asarray(volts[::every]))


@eqx.filter_jit
def _told(estimator: Any, readings: Any, volts: Any) -> Any:
    def one(row: Any) -> Any:
        memory, estimated = estimate(estimator, row, volts, PERIOD)
        return estimated, memory.innovation.value**2 / memory.innovation.variance

    return jax.vmap(one)(readings)


def judged(estimator: Any, run: Record, readings: Any = None) -> tuple[dict[str, float], Any]:
    """(errors by quantity, overall and at the turn, with the mean squared normalised innovation; estimates)."""
    estimated, squares = recorded(_told(estimator, run.readings if readings is None else readings, run.volts))
    true, time = run.true, run.true.time
    turn = np.abs(time - time[true.position.argmax()]) < 0.25
    landed = (true.position <= float(true.position.min()) + 1e-6) & (time > 3.0)
    air = (time > 0.1) & (time < (time[landed][0] - PERIOD if landed.any() else np.inf))
    errors = {}
    for name, (factor, _) in SHOWN.items():
        off = (factor * (getattr(estimated, name) - getattr(true, name))) ** 2
        errors[name] = float(np.sqrt(off[:, air].mean()))
        errors[f"{name}_turn"] = float(np.sqrt(off[:, turn].mean()))
    errors["innovation"] = float(squares[:, air].mean())
    return errors, estimated


def _shown(label: str, errors: dict[str, float]) -> None:
    both = "".join(f"{errors[name]:>10.4f} /{errors[f'{name}_turn']:>9.4f}" for name in SHOWN)
    print(f"{label:38}{both}{errors['innovation']:>9.2f}", flush=True)


def main(fast: bool = False) -> dict[str, dict[str, float]]:
    """Print the table, draw the picture; errors by case."""
    system = arm()
    run = record(system, 4 if fast else 16)
    table: dict[str, dict[str, float]] = {}
    print(
        f"{'overall / at the turn':38}" + "".join(f"{f'{n} ({u})':>21}" for n, (_, u) in SHOWN.items()) + "    innov."
    )

    def tried(label: str, estimator: Any, against: Record, readings: Any = None) -> Any:
        table[label], estimated = judged(estimator, against, readings)
        _shown(label, table[label])
        return estimated

    printed, model = printed_filter(system), model_filter(system)
    for variance in READING_VARIANCES[::2] if fast else READING_VARIANCES:
        for jacobian in (PastCarried(), PastDropped()):
            one = set_parameters(dataclasses.replace(printed, jacobian=jacobian), {"reading_variance": variance})
            for kind, readings in (("exact", run.true.position[None]), ("noisy", None)):
                tried(f"printed, {type(jacobian).__name__}, R = {variance:g}, {kind}", one, run, readings)

    walks = ("position_walk", "velocity_walk", "temperature_walk", "fraction_walk")
    sizes = get_parameters(model, walks)
    filters = {"extended": model, "unscented": dataclasses.replace(model, prediction=Unscented())}
    for plant, changes in list(PLANTS.items())[:: 4 if fast else 1]:
        against = record(set_parameters(system, changes), len(run.readings))
        for times in (1.0,) if fast else WALKS:
            for name, one in filters.items():
                scaled = set_parameters(one, dict(zip(walks, times * sizes, strict=True)))
                tried(f"{name}, {plant}, walks x {times:g}", scaled, against)
    starts = {}
    for start, degrees in STARTS.items():
        for name, one in filters.items():
            wrong = set_parameters(one, {"start_temperature": degrees, "start_temperature_error": 15.0})
            starts[name, start] = tried(f"{name}, {start}", wrong, run)

    if not fast:
        _draw(table, starts, run)
    return table


def _draw(table: dict[str, dict[str, float]], starts: dict[tuple[str, str], Any], run: Record) -> None:
    figure = Figure(figsize=(12.0, 4.0))
    printed, walks, cold = panels(figure, 1, 3)
    for jacobian, colour in (("PastCarried", BLUE), ("PastDropped", RED)):
        for kind, style in (("exact", "--"), ("noisy", "-")):
            errors = [
                table[f"printed, {jacobian}, R = {variance:g}, {kind}"]["stress"] for variance in READING_VARIANCES
            ]
            printed.semilogx(READING_VARIANCES, errors, style, color=colour, label=f"{jacobian}, {kind}")
    named(printed, "R of the printed filter (rad²)", "error of the stress (MPa)", "printed filter, Q = 0.01 I")
    for plant, colour in zip(PLANTS, ("#1d1d1f", BLUE, RED, GREEN, GREY), strict=True):
        for name, style in (("extended", "-"), ("unscented", ":")):
            at = [table[f"{name}, {plant}, walks x {times:g}"]["innovation"] for times in WALKS]
            walks.loglog(WALKS, at, style, color=colour, label=plant if name == "extended" else None)
    walks.axhline(1.0, color=GREY, linewidth=0.8)
    named(walks, "random walks over the preset's", "mean squared innovation over its variance", "dotted: unscented")
    for (name, start), estimated in starts.items():
        off = np.sqrt(((estimated.temperature - run.true.temperature) ** 2).mean(axis=0))
        drawn: dict[str, Any] = {
            "color": BLUE if name == "extended" else RED,
            "linestyle": "-" if "cold" in start else "--",
        }
        cold.semilogy(run.true.time, off, label=f"{name}, {start}", **drawn)
    cold.set_xlim(0.0, 3.0)
    named(cold, "time (s)", "error of the temperature (°C)", "believed too warm and too cold")
    for axes in figure.axes:
        keyed(axes)
    figure.savefig(PICTURE, dpi=90)


if __name__ == "__main__":
    jax.config.update("jax_enable_x64", True)
    main("--fast" in sys.argv)
