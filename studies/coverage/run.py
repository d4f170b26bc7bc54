"""How often a 95 % interval contains the true value, and what a fit costs: `python -m studies.coverage.run [--fast]`.

Data: a hung weight in three runs by scipy's tight integration, which shares no code with the package, with white noise
drawn again for each repeated experiment. Six parameters, each starting 30 % off. All repeated experiments are one batch
of fits. Beside it scipy's `least_squares` with differences on the same simulator, for the first few of them.
"""

from __future__ import annotations

import json
import sys
import time as clock
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares

from smajax.core.runtime import prepare
from smajax.fit.levenberg_marquardt import MAX_STEPS, Fit, FitSettings, levenberg_marquardt
from smajax.fit.sensitivity import sensitivity
from smajax.fit.uncertainty import uncertainty
from studies.coverage.rig import BOUNDS, NOISE, Rig, rig

HERE = Path(__file__).parent
SEED = 6
WITHIN = 1.959964


def repeated(rig: Rig, count: int, most: int = MAX_STEPS) -> tuple[list[Fit], np.ndarray]:
    """Fits of `count` noisy repetitions, and their outputs (count, R, N)."""
    exact = np.asarray(rig.problem.batch.output)
    noise = NOISE * np.random.default_rng(SEED).standard_normal((count, *exact.shape))
    outputs = exact + noise
    task = rig.problem.task(rig.names, BOUNDS, rig.start)
    return levenberg_marquardt(rig.problem, [task] * count, FitSettings(most), outputs=outputs), outputs


def errors(rig: Rig, solutions: list[Fit], outputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(estimate - truth, standard error), each (count, parameters); the errors are those that `identify` reports."""
    problem = rig.problem
    off, spread = [], []
    for one, output in zip(solutions, outputs, strict=True):
        at = sensitivity(problem.with_output(jnp.asarray(output)), one.values, rig.names)
        values = {name: float(one.values[problem.names.index(name)]) for name in rig.names}
        known = uncertainty(at, rig.names, values, BOUNDS)
        off.append([values[name] - rig.truth[name] for name in rig.names])
        spread.append([known.standard_error[name] or np.nan for name in rig.names])
    return np.asarray(off), np.asarray(spread)


def by_scipy(rig: Rig, outputs: np.ndarray) -> tuple[list[float], float, float]:
    """(cost of each fit, seconds a fit, processor seconds) of `least_squares` on the same compiled simulator."""
    problem = rig.problem
    slots = np.asarray([problem.names.index(name) for name in rig.names])
    low, high = (np.asarray([BOUNDS[name][side] for name in rig.names]) for side in (0, 1))

    @eqx.filter_jit
    def misfit(values: jax.Array, output: jax.Array) -> jax.Array:
        return problem.with_output(output).misfit(values).ravel() / problem.noise_sigma

    def residual(chosen: np.ndarray, output: jax.Array) -> np.ndarray:
        values = np.array(rig.start)
        values[slots] = chosen
        return np.asarray(misfit(jnp.asarray(values), output))

    residual(rig.start[slots], jnp.asarray(outputs[0]))  # compiled before the clock starts
    began, worked = clock.perf_counter(), clock.process_time()
    costs = [
        2.0
        * least_squares(
            residual, rig.start[slots], bounds=(low, high), x_scale=high - low, args=(jnp.asarray(output),)
        ).cost
        for output in outputs
    ]
    each, work = (clock.perf_counter() - began) / len(outputs), (clock.process_time() - worked) / len(outputs)
    return [float(cost) for cost in costs], each, work


def study(fast: bool) -> dict[str, Any]:
    """Everything as numbers."""
    dt, fine, count, peers = (0.02, 0.02, 40, 2) if fast else (0.02, 0.005, 200, 20)
    exact = rig(fine)
    task = exact.problem.task(exact.names, BOUNDS, exact.start)
    best = levenberg_marquardt(exact.problem, [task])[0]
    index = exact.problem.names.index
    without = {name: float(best.values[index(name)] / exact.truth[name] - 1.0) for name in exact.names}
    here = rig(dt)
    repeated(here, 1, most=1)  # compiled before the clock starts
    began, worked = clock.perf_counter(), clock.process_time()
    solutions, outputs = repeated(here, count)
    each, work = (clock.perf_counter() - began) / count, (clock.process_time() - worked) / count
    off, spread = errors(here, solutions, outputs)
    inside = np.abs(off) <= WITHIN * spread
    theirs, seconds, processor = by_scipy(here, outputs[:peers])
    return {
        "experiments": count,
        "step_s": dt,
        "converged": int(sum(one.converged for one in solutions)),
        "steps_of_a_fit": float(np.mean([one.steps for one in solutions])),
        "step_without_noise_s": fine,
        "samples": int(outputs[0].size),
        "noise_m": NOISE,
        "without_noise_relative_error": without,
        "coverage": dict(zip(here.names, inside.mean(axis=0).tolist(), strict=True)),
        "coverage_of_all": float(inside.mean()),
        "bias_in_standard_errors": dict(zip(here.names, (off / spread).mean(axis=0).tolist(), strict=True)),
        "spread_over_standard_error": dict(
            zip(here.names, (off.std(axis=0) / spread.mean(axis=0)).tolist(), strict=True)
        ),
        "relative_standard_error": {
            name: float(spread[:, k].mean() / abs(here.truth[name])) for k, name in enumerate(here.names)
        },
        "seconds_a_fit": each,
        "processor_seconds_a_fit": work,
        "devices": jax.local_device_count(),
        "scipy": {
            "fits": peers,
            "seconds_a_fit": seconds,
            "processor_seconds_a_fit": processor,
            "ratio": seconds / each,
            "ratio_of_processor_seconds": processor / work,
            "cost_over_ours": [cost / one.cost for cost, one in zip(theirs, solutions, strict=False)],
        },
    }


def page(result: dict[str, Any]) -> str:
    """The README."""
    rows = [
        f"| {name} | {100 * result['relative_standard_error'][name]:.2g} % | {100 * result['coverage'][name]:.1f} % | "
        f"{result['bias_in_standard_errors'][name]:+.2f} | {result['spread_over_standard_error'][name]:.2f} | "
        f"{result['without_noise_relative_error'][name]:+.1e} |"
        for name in result["coverage"]
    ]
    scipy = result["scipy"]
    worst = max(scipy["cost_over_ours"]), min(scipy["cost_over_ours"])
    return "\n".join(
        [
            "# How often the interval of a fit contains the true value, with white noise",
            "",
            f"{result['experiments']} repeated experiments of a hung weight in three runs of 12 s (switched, ramped, pulsed; "
            f"{result['samples']} samples, {1e3 * result['noise_m']:g} mm of noise), integrated by scipy from event to event; six "
            f"parameters fitted at a step of {1e3 * result['step_s']:g} ms from one start each, 30 % off (a temperature: by its "
            f"distance from the air). {result['converged']} of the fits converged. Of all intervals {100 * result['coverage_of_all']:.1f} % contain the true value; by chance a row "
            f"may differ by {100 * np.sqrt(0.05 * 0.95 / result['experiments']):.1f} points, a bias by "
            f"{1.0 / np.sqrt(result['experiments']):.2f}.",
            "",
            "| parameter | standard error | intervals that contain the true value | bias, in standard errors | spread over standard error "
            f"| error without noise, at {1e3 * result['step_without_noise_s']:g} ms |",
            "|---|---|---|---|---|---|",
            *rows,
            "",
            f"A fit takes {result['seconds_a_fit']:.2f} s in the batch of all, which goes over all {result['devices']} cores. scipy's `least_squares` with differences on the same "
            f"compiled simulator takes {scipy['seconds_a_fit']:.1f} s, {scipy['ratio']:.1f} times as long ({scipy['fits']} fits) "
            f"and {scipy['ratio_of_processor_seconds']:.1f} times the processor time, and ends at {worst[1]:.7f} to "
            f"{worst[0]:.7f} times the cost. Much of that is the batch: one fit at a time, and by machine code for both, it is some four times as "
            "long, and 1.3 to 1.4 times where scipy is given our derivatives.",
            "",
            "A bias beyond chance (martensite_start, specific_heat) comes from the model, which is not linear over an error bar: with "
            "another seed it was similar, and 93.3 % of all intervals contained the true value, 90.5 % of martensite_start's. Profiles and "
            "Huber's loss are not included, nor autocorrelated noise, of which few samples are independent: intervals by standard errors "
            "were too short there (72 to 87 % contained the true value at an AR(1) of 0.8, before they were widened; on a coupon of 2 x 241 samples 87 to 97 % contain it at an AR(1) of 0.8 and 0.95 since, where it was 37 to 77 %), see `tests/fit/test_uncertainty.py`.",
            "",
            "Made by `python -m studies.coverage.run`.",
            "",
        ]
    )


def main(fast: bool) -> None:
    prepare(cores=True)  # compiled to run fast
    result = study(fast)
    print(json.dumps(result, indent=1))
    if not fast:
        (HERE / "coverage.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
        (HERE / "README.md").write_text(page(result), encoding="utf-8")


if __name__ == "__main__":
    main("--fast" in sys.argv)
