"""What the integration leaves in a log's outputs, and what it costs: `python -m studies.integration [--fast]`.

Against the event-aware scipy integration of `studies/reference` (DOP853, rtol 1e-9): the arm, a dead weight whose mass changes,
a bias spring and a coupon, each with the same run logged at six clocks. Shown by rig and clock: the error of one step a sample
and of the integration that a fit of this log chooses (rms over the run, in noises of the output), the processor time of a run with its
derivatives by eight parameters, and the time that equal steps take until their error is as small. Then the same of a simulation, which knows
no noise: what it leaves, what it says it leaves, and its time without derivatives and without the check.
"""

from __future__ import annotations

import dataclasses
import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from smajax.core.parameters import parameter_values, set_parameters
from smajax.core.runtime import prepare
from smajax.data.experiment.record import Run
from smajax.fit.integration import choose_integration, described, with_integration
from smajax.fit.outputs_of_runs import predicted_and_derivatives
from smajax.fit.packed_runs import pack, predict_compiled
from smajax.fit.problem import Problem
from smajax.model.presets import build
from smajax.model.system import System, initial_state
from smajax.simulation.compiled import compiled_run
from smajax.simulation.dataset import simulate_dataset
from smajax.simulation.integration_error import alone
from smajax.simulation.steppers import ONE_STEP, Integration
from studies.reference.path_reference import simulate_path
from studies.reference.wire_parameters import ArmParameters, BiasSpringParameters, DeadWeightParameters, WireParameters
from studies.reference.wire_reference import simulate_arm, simulate_bias_spring, simulate_dead_weight

RESULT = Path(__file__).parent / "integration.json"
TABLE = RESULT.with_suffix(".md")
CLOCKS = (0.002, 0.005, 0.02, 0.05, 0.1, 0.25)  # s between samples of a log
GRID = 0.5  # s between changes of an input: a whole number of samples at each clock
SECONDS = 40.0
LEVELS = (
    0.0,
    1.0,
    1.0,
    0.8,
    0.0,
    0.0,
    0.6,
    0.9,
    1.0,
    0.5,
    0.2,
    0.0,
    0.95,
    0.7,
    0.0,
    0.85,
    0.9,
    0.0,
    0.0,
    0.3,
)  # 2 s each
FREE = (
    "convection_coefficient",
    "specific_heat",
    "recoverable_strain",
    "austenite_start",
    "austenite_finish",
    "martensite_start",
    "martensite_finish",
    "stress_slope_austenite",
)
REPEATS = 3
MOST_EQUAL = 64  # equal steps a sample that are tried


@dataclass(frozen=True)
class Rig:
    """A system, its inputs at given times, its exact reading at given times, and its sensor's noise (SI)."""

    system: System
    inputs: Callable[[np.ndarray], dict[str, np.ndarray]]
    exact: Callable[[np.ndarray], np.ndarray]
    noise: float


def _level(times: np.ndarray, levels: tuple[float, ...]) -> np.ndarray:
    return np.asarray(levels)[np.minimum((times / 2.0 + 1e-9).astype(int), len(levels) - 1)]


def _pieces(top: float) -> list[tuple[float, float]]:
    return [(2.0 * (k + 1), top * level) for k, level in enumerate(LEVELS)]


def _arm() -> Rig:
    system = build("niti_table_3_1", "arm", "amplified_voltage")
    start = initial_state(system, {"voltage": jnp.asarray(0.0)})
    parameters = ArmParameters(
        surface_per_metre=float(np.pi * 150e-6),
        initial_stress=float(start.wire.stress),
        recoverable_strain=float(system.wire.constitutive.recoverable_strain),
        spring_radius=float(system.load.spring_lever),
    )
    return Rig(
        system,
        lambda times: {"voltage": 8.0 * _level(times, LEVELS)},
        lambda times: simulate_arm(parameters, _pieces(8.0), times)["angle"],
        float(np.radians(0.1)),
    )


def _dead_weight() -> Rig:
    masses = tuple(0.110 if (k // 4) % 2 == 0 else 0.075 for k in range(len(LEVELS)))
    segments = [(end, volts, masses[k]) for k, (end, volts) in enumerate(_pieces(7.95))]
    return Rig(
        build("flexinol_table_3_2", "dead_weight", "voltage"),
        lambda times: {"voltage": 7.95 * _level(times, LEVELS), "mass": _level(times, masses)},
        lambda times: simulate_dead_weight(DeadWeightParameters(), segments, times)["position"],
        1e-5,
    )


def _bias_spring() -> Rig:
    system = build("flexinol_table_3_2", "bias_spring", "voltage")
    values = {"slider_mass": 0.3, "damping": 20.0, "spring_stiffness": 60.0, "spring_preload": 1.5}
    system = set_parameters(system, values)
    own = DeadWeightParameters()  # the same wire
    wire = {one.name: getattr(own, one.name) for one in dataclasses.fields(WireParameters)}
    parameters = BiasSpringParameters(**{**wire, **values})
    return Rig(
        system,
        lambda times: {"voltage": 7.95 * _level(times, LEVELS)},
        lambda times: simulate_bias_spring(parameters, _pieces(7.95), times)["position"],
        1e-5,
    )


def _coupon() -> Rig:
    """Heated and cooled by 40 C a second through both ranges, while the stress follows a triangle of its own."""
    system = build("flexinol_table_3_2", "coupon", "none")
    own = DeadWeightParameters()
    corners = [(30.0, 100e6)]
    for k in range(int(SECONDS / GRID)):
        warm = (k // 4) % 2 == 0
        corners.append((corners[-1][0] + (20.0 if warm else -20.0), 100e6 + (10e6 if k % 2 == 0 else 0.0)))
    path = np.asarray(corners)

    def inputs(times: np.ndarray) -> dict[str, np.ndarray]:
        at = np.arange(len(path)) * GRID
        return {"temperature": np.interp(times, at, path[:, 0]), "stress": np.interp(times, at, path[:, 1])}

    wire = WireParameters(**{one.name: getattr(own, one.name) for one in dataclasses.fields(WireParameters)})
    return Rig(
        system,
        inputs,
        lambda times: simulate_path(wire, corners, times / GRID, initial_stress=100e6)["strain"],
        1e-4,
    )


RIGS: dict[str, Callable[[], Rig]] = {
    "arm": _arm,
    "dead weight": _dead_weight,
    "bias spring": _bias_spring,
    "coupon": _coupon,
}


def _problem(rig: Rig, clock: float) -> Problem:
    times = np.asarray(np.arange(round(SECONDS / clock) + 1) * clock, dtype=np.float64)
    name = rig.system.load.reading[0]
    run = Run(
        "log", "fit", times, rig.inputs(times), {name: np.asarray(rig.exact(times), dtype=np.float64)}, {}, (), ""
    )
    return Problem.build(rig.system, pack([run], clock, parameter_values(rig.system)), rig.noise, False)


def _error(problem: Problem) -> tuple[float, float]:
    """(rms, largest) of the first output against the exact one, in noises; a constant difference is no error of a coupon."""
    difference = predict_compiled(problem.system, problem.batch)[0] - np.asarray(problem.batch.output)[0]
    difference = difference - difference[0]
    scale = float(problem.noise[0, 0])
    return float(np.sqrt(np.mean(difference**2))) / scale, float(np.abs(difference).max()) / scale


def _seconds(problem: Problem) -> float:
    """Processor time of a run with its derivatives."""
    names = [name for name in FREE if name in problem.names]
    tangents = np.eye(len(problem.names))[[problem.names.index(name) for name in names]]
    point = problem.start_values()[None]
    times = []
    for _ in range(REPEATS + 1):
        begin = time.process_time()
        predicted_and_derivatives(problem, point, tangents[None])
        times.append(time.process_time() - begin)
    return min(times[1:])


def _finer(rig: Rig, clock: float, number: int) -> Problem:
    """The same run at `number` samples in the place of one; its outputs are not known there."""
    times = np.asarray(np.arange(round(SECONDS / clock) * number + 1) * (clock / number), dtype=np.float64)
    name = rig.system.load.reading[0]
    run = Run("log", "fit", times, rig.inputs(times), {name: np.zeros(times.size)}, {}, (), "")
    return Problem.build(rig.system, pack([run], clock / number, parameter_values(rig.system)), rig.noise, False)


def _equal_steps(rig: Rig, problem: Problem, clock: float, rms: float) -> tuple[int, float] | None:
    """(how many equal steps a sample leave no more than `rms`, their time); None where the most that are tried leave more."""
    exact = np.asarray(problem.batch.output)[0]
    number = 2
    while number <= MOST_EQUAL:
        fine = _finer(rig, clock, number)
        difference = predict_compiled(fine.system, fine.batch)[0][::number] - exact
        if np.sqrt(np.mean((difference - difference[0]) ** 2)) / rig.noise <= rms:
            return number, _seconds(fine)
        number *= 2
    return None


def _compiled_seconds(rig: Rig, clock: float, integration: Integration) -> float:
    """Processor time of a run alone, without derivatives."""
    inputs: Any = rig.inputs(np.arange(round(SECONDS / clock) + 1) * clock)
    times = []
    for _ in range(REPEATS + 1):
        begin = time.process_time()
        compiled_run(rig.system, inputs, clock, integration)
        times.append(time.process_time() - begin)
    return min(times[1:])


def _off(rig: Rig, reading: Any, exact: np.ndarray) -> float:
    difference = np.asarray(reading) - exact
    return float(np.sqrt(np.mean((difference - difference[0]) ** 2))) / rig.noise


def simulated(rig: Rig, clock: float, exact: np.ndarray, compare: bool = True) -> dict[str, Any]:
    """What a simulation at this clock leaves by default, in noises, and the equal steps a sample that leave no more.

    exact: the reading at every sample.
    """
    inputs: Any = rig.inputs(np.arange(round(SECONDS / clock) + 1) * clock)
    found = simulate_dataset(rig.system, inputs, clock)
    error = json.loads(found.attrs["integration_error"])
    chosen = next(one for one in alone(rig.system) if described(one) == error["how"])
    rms = _off(rig, found["reading"].to_numpy(), exact)
    row: dict[str, Any] = {
        "how": error["how"],
        "rms": rms,
        "reported rms": error["outputs"]["reading"]["rms"] / rig.noise,
        "ms": 1e3 * _compiled_seconds(rig, clock, chosen),
        "one step": {
            "rms": _off(rig, compiled_run(rig.system, inputs, clock, ONE_STEP).reading, exact),
            "ms": 1e3 * _compiled_seconds(rig, clock, ONE_STEP),
        },
        "equal steps as exact": None,
    }
    number = 2
    while compare and chosen.tolerance is not None and number <= MOST_EQUAL:
        equal = Integration(substeps=number)
        if _off(rig, compiled_run(rig.system, inputs, clock, equal).reading, exact) <= rms:
            row["equal steps as exact"] = {"number": number, "ms": 1e3 * _compiled_seconds(rig, clock, equal)}
            break
        number *= 2
    return row


def measured(rig: Rig, clock: float, compare: bool = True) -> dict[str, Any]:
    """One row of the table."""
    problem = _problem(rig, clock)
    chosen: Integration = choose_integration(problem, problem.system)
    one, own = with_integration(problem, ONE_STEP), with_integration(problem, chosen)
    (one_rms, one_largest), (rms, largest) = _error(one), _error(own)
    row: dict[str, Any] = {
        "clock_ms": 1e3 * clock,
        "one step": {"rms": one_rms, "largest": one_largest, "ms": 1e3 * _seconds(one)},
        "chosen": {"how": described(chosen), "rms": rms, "largest": largest, "ms": 1e3 * _seconds(own)},
    }
    equal = _equal_steps(rig, problem, clock, rms) if compare and chosen is not ONE_STEP else None
    row["equal steps as exact"] = None if equal is None else {"number": equal[0], "ms": 1e3 * equal[1]}
    row["simulated"] = simulated(rig, clock, np.asarray(problem.batch.output)[0], compare)
    return row


def _ratio(row: dict[str, Any], ms: float) -> str:
    equal = row["equal steps as exact"]
    return f"{ms / equal['ms']:.2f} of {equal['number']} steps" if equal else "–"


def as_markdown(table: dict[str, list[dict[str, Any]]]) -> str:
    """The record as two tables."""
    head = [
        "# What an integration leaves, and what it costs",
        "",
        "Written by `python -m studies.integration`, which also writes [integration.json](integration.json). Errors are root mean squares over 40 s of the",
        "sensor's reading, against an integration by scipy from event to event, in noises of the output (arm 0.1 degrees, dead weight and bias spring 10 um,",
        "coupon 1e-4 of strain); times are milliseconds of one processor. The last column is the time over that of the equal steps that leave no more (up to 64 a sample).",
    ]
    lines = [*head, "", "## Fits: a run with its derivatives by eight parameters", ""]
    lines += [
        "| rig | clock, ms | one step | ms | chosen | how | ms | against equal steps |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, rows in table.items():
        for row in rows:
            one, own = row["one step"], row["chosen"]
            lines.append(
                f"| {name} | {row['clock_ms']:g} | {one['rms']:.2g} | {one['ms']:.1f} | {own['rms']:.2g} | {own['how']} | {own['ms']:.1f} | "
                f"{_ratio(row, own['ms'])} |"
            )
    lines += ["", "## Simulations: a run alone, by default", ""]
    lines += [
        "| rig | clock, ms | one step | ms | by default | as reported | how | ms | against equal steps |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, rows in table.items():
        for row in rows:
            own = row["simulated"]
            one = own["one step"]
            lines.append(
                f"| {name} | {row['clock_ms']:g} | {one['rms']:.2g} | {one['ms']:.1f} | {own['rms']:.2g} | {own['reported rms']:.2g} | "
                f"{own['how']} | {own['ms']:.1f} | {_ratio(own, own['ms'])} |"
            )
    return "\n".join([*lines, ""])


def main(fast: bool = False) -> dict[str, list[dict[str, Any]]]:
    """Print the table and keep it as JSON; rows by rig."""
    clocks = (0.02, 0.1) if fast else CLOCKS
    table: dict[str, list[dict[str, Any]]] = {}
    print(f"{'rig':12}{'clock':>8}{'one step':>20}{'chosen':>44}{'equal steps':>20}")
    for name, make in RIGS.items():
        rig = make()
        table[name] = []
        for clock in clocks:
            row = measured(rig, clock, compare=not fast)
            table[name].append(row)
            one, own, equal = row["one step"], row["chosen"], row["equal steps as exact"]
            more = f"{equal['number']:>6} {equal['ms']:.1f} ms" if equal else "–"
            print(
                f"{name:12}{1e3 * clock:>5g} ms{one['rms']:>10.4f} {one['ms']:>6.1f} ms"
                f"{own['rms']:>12.4f} {own['ms']:>6.1f} ms  {own['how'][-20:]:>20}{more:>20}",
                flush=True,
            )
    if not fast:
        RESULT.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
        TABLE.write_text(as_markdown(table), encoding="utf-8")
    return table


if __name__ == "__main__":
    prepare()
    main("--fast" in sys.argv)
