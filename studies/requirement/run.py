"""`python -m studies.requirement.run`: judges the controllers (some minutes); `--search NAME...` first searches gains again (a minute each).

Writes `results.json` and the table of `README.md`.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import qmc

from smajax.control.gains_file import Gains, read_gains, write_gains
from smajax.control.interface import Interface, interface_of
from smajax.control.least_time import Largest
from smajax.control.presets import CONTROLLERS
from smajax.control.sweep.batched_loops import LoopSetup, closed_loops
from smajax.control.sweep.grid import loop_rows
from smajax.control.tune.scenarios import tuned_on
from smajax.core.files import json_text, replace
from smajax.core.parameters import get_parameters
from smajax.core.runtime import prepare
from smajax.model.rigs import arm
from studies.requirement.search import DELAY, FILTER, LIMITS, NOISE, PERIOD, VARIATION, searched

HERE = Path(__file__).parent
GAINS = HERE / "gains"
DRAWN, SEED = 256, 20261125
LOW, HIGH, APART = -40.0, 85.0, 10.0  # degrees
STEP = 0.01  # s
FULL = 10.0  # V
SECONDS = 10.0
MARK = "<!-- table -->"


def judged_on() -> np.ndarray:
    """Rows of loops that no gain was tuned on: the corners midway between round set points, and plants drawn with a set point each."""
    corners = tuned_on(list(np.arange(LOW + 0.75 * APART, HIGH, APART)), VARIATION, 0).rows
    shares = qmc.Sobol(len(VARIATION) + 1, rng=SEED).random(DRAWN)
    named = {name: 1.0 + (2.0 * shares[:, k] - 1.0) * size for k, (name, size) in enumerate(VARIATION.items())}
    drawn = loop_rows(named, np.radians(LOW + (HIGH - LOW) * shares[:, -1]))
    return np.concatenate([np.append(corners, np.ones((len(corners), 1)), axis=1), drawn])


def judged(name: str, interface: Interface, rows: np.ndarray, gains: Gains, least: np.ndarray) -> dict[str, Any]:
    """Shares of loops, and the times over the least ones."""
    preset = CONTROLLERS[name]
    plant = preset.plant(arm())
    setup = LoopSetup(plant, gains.put(plant), preset.main_gain, SECONDS, STEP, interface)
    merits = closed_loops(setup, rows).merits
    settling, overshoot = np.asarray(merits.settling_time), np.degrees(merits.overshoot)
    error = np.degrees(merits.steady_error)
    met = (settling <= LIMITS["settling_time"]) & (overshoot <= LIMITS["overshoot"])
    met &= error <= LIMITS["steady_error"]
    over = settling / least
    return {
        "loops": len(rows),
        "met": int(met.sum()),
        "settled": int(np.isfinite(settling).sum()),
        "median_settling_s": _finite(np.median(settling)),
        "worst_settling_s": _finite(settling.max()),
        "worst_overshoot_deg": float(overshoot.max()),
        "worst_steady_error_deg": float(error.max()),
        "median_settling_over_least_time": _finite(np.median(over)),
        "median_reach_over_least_time": _finite(np.median(np.asarray(merits.reach_time) / least)),
    }


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def gains_of(name: str) -> tuple[Gains, str]:
    """Those found on the filter, or the preset's."""
    path = GAINS / f"{name}.json"
    return (read_gains(path, arm()), "searched on the filter") if path.exists() else (Gains(name, {}), "preset")


def table(results: dict[str, Any]) -> str:
    """A row a controller."""
    lines = [
        "| controller | gains | met, filter | settled, filter | median / worst settling, s | worst overshoot, ° | worst steady error, ° | settling over the least time, median | met, true state |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    never = lambda value, digits=2: "never" if value is None else f"{value:.{digits}f}"  # noqa: E731
    for name, one in results.items():
        seen, true = one["filter"], one["true_state"]
        lines.append(
            f"| {name} | {one['gains']} | {100.0 * seen['met'] / seen['loops']:.1f} % | {100.0 * seen['settled'] / seen['loops']:.1f} % "
            f"| {never(seen['median_settling_s'])} / {never(seen['worst_settling_s'])} | {seen['worst_overshoot_deg']:.1f} "
            f"| {seen['worst_steady_error_deg']:.2f} | {never(seen['median_settling_over_least_time'])} "
            f"| {100.0 * true['met'] / true['loops']:.1f} % |"
        )
    return "\n".join(lines)


def main(arguments: list[str]) -> None:
    """Search what is asked for, judge all, write."""
    prepare(cores=True)
    again = [one for one in arguments if not one.startswith("--")] if "--search" in arguments else []
    for name in again:
        start, _ = gains_of(name)
        box = list(CONTROLLERS[name].box)
        whole = dict(zip(box, map(float, get_parameters(start.put(arm()), box)), strict=True))
        gains = Gains(name, searched(name, whole))
        write_gains(GAINS / f"{name}.json", gains, gains.units(arm()), {"by": "studies.requirement.search"})
    rows, system = judged_on(), arm()
    least = np.asarray(
        closed_loops(LoopSetup(system, Largest(FULL), "largest_voltage", 3.0, STEP), rows).merits.reach_time
    )
    between = interface_of(system, FILTER, NOISE, PERIOD, STEP, DELAY)
    path = HERE / "results.json"
    results: dict[str, Any] = {}
    for name in CONTROLLERS:
        gains, origin = gains_of(name)
        results[name] = {
            "gains": origin,
            "true_state": judged(name, Interface(), rows, gains, least),
            "filter": judged(name, between, rows, gains, least),
        }
        print(name, json.dumps(results[name]), flush=True)
    replace(path, json_text(results))
    text = (HERE / "README.md").read_text(encoding="utf-8")
    before, _, rest = text.partition(MARK)
    _, _, after = rest.partition(MARK)
    replace(HERE / "README.md", f"{before}{MARK}\n\n{table(results)}\n\n{MARK}{after}")


if __name__ == "__main__":
    main(sys.argv[1:])
