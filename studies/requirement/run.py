"""`python -m studies.requirement.run`: judges the controllers (some minutes); with names these alone, beside the stored numbers of the others.

`--search NAME...` first searches gains again (some minutes each), `--quick WEIGHT` with a weight of the settling time, `--seed NUMBER` with other draws. Writes `results.json` and the tables of `README.md`.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from smajax.control.gains_file import Gains, read_gains, write_gains
from smajax.control.least_time import command_limit, distance
from smajax.control.presets import CONTROLLERS
from smajax.control.signal_path import Interface, interface_of
from smajax.control.sweep.batched_loops import LoopSetup, closed_loops
from smajax.control.tune.scenarios import tuned_on
from smajax.core.files import json_text, replace
from smajax.core.parameters import get_parameters
from smajax.core.runtime import prepare
from smajax.model.rigs import arm
from studies.marked import put
from studies.requirement.search import (
    DELAY,
    FILTER,
    FULL,
    HIGH,
    LIMITS,
    LOW,
    NOISE,
    PERIOD,
    QUANTUM,
    VARIATION,
    box_of,
    drawn,
    least_times,
    searched,
)

# The controllers that this study, `studies.sweep` and `studies.disturbances` compare: one that is added here is run by all three.
COMPARED = (
    *("pid", "vsc1", "vsc2", "vsc3", "nvsc", "sld", "backstepping1", "backstepping2"),
    *("backstepping1_integral", "backstepping2_integral", "feedforward_pi", "receding_horizon"),
)
HERE = Path(__file__).parent
GAINS = HERE / "gains"
QUICKEST = "backstepping1_integral"
FRONTIER = GAINS / "frontier"  # its other gains
DRAWN, SEED = 256, 20261125
FRESH = 1024
APART = 10.0  # degrees
STEP = 0.01  # s
SECONDS = 10.0
NOMINAL = "model"  # the filter that believes in the nominal plant
ASKED = 0.99  # share of the loops
MARK, FRONTIER_MARK = "<!-- table -->", "<!-- frontier -->"


def judged_on() -> np.ndarray:
    """Rows of loops that no gain was tuned on: the corners midway between round set points, and plants drawn with a set point each."""
    corners = tuned_on(list(np.arange(LOW + 0.75 * APART, HIGH, APART)), VARIATION, 0).rows
    return np.concatenate([np.append(corners, np.ones((len(corners), 1)), axis=1), drawn(DRAWN, SEED)])


def judged(name: str, interface: Interface, rows: np.ndarray, gains: Gains) -> dict[str, Any]:
    """Shares of loops, and the times over the least ones: under 10 V, and under the limit of the controller's own command."""
    preset = CONTROLLERS[name]
    plant = preset.plant(arm())
    controller = gains.put(plant)
    setup = LoopSetup(plant, controller, preset.main_gain, SECONDS, STEP, interface)
    merits = closed_loops(setup, rows).merits
    settling, overshoot = np.asarray(merits.settling_time), np.degrees(merits.overshoot)
    error = np.degrees(merits.steady_error)
    within = {
        "settling_time": settling <= LIMITS["settling_time"],
        "overshoot": overshoot <= LIMITS["overshoot"],
        "steady_error": error <= LIMITS["steady_error"],
    }
    limit, reach = command_limit(plant, controller), np.asarray(merits.reach_time)
    return {
        "loops": len(rows),
        "met": int(np.all(list(within.values()), axis=0).sum()),
        "beyond": {limit: int((~one).sum()) for limit, one in within.items()},
        "settled": int(np.isfinite(settling).sum()),
        "median_settling_s": _finite(np.median(settling)),
        "worst_settling_s": _finite(settling.max()),
        "worst_overshoot_deg": float(overshoot.max()),
        "worst_steady_error_deg": float(error.max()),
        "over_least_time": _over(settling, reach, least_times(rows, FULL, preset.plant)) | {"limit_V": FULL},
        "over_least_time_under_own_limit": _over(settling, reach, least_times(rows, limit, preset.plant))
        | {"limit_V": limit},
    }


def _over(settling: np.ndarray, reach: np.ndarray, least: np.ndarray) -> dict[str, Any]:
    """`Distance` of the loops, and the median of the time to be there over the least one, of those that are in reach."""
    found = distance(settling, least)._asdict()
    first = np.median(reach[np.isfinite(least)] / least[np.isfinite(least)])
    return {name: one if isinstance(one, int) else _finite(one) for name, one in found.items()} | {
        "median_to_be_there": _finite(float(first))
    }


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def gains_of(name: str) -> tuple[Gains, str]:
    """Those found on the filter, or the preset's."""
    path = GAINS / f"{name}.json"
    if not path.exists():
        return Gains(name, {}), "preset"
    origin = json.loads(path.read_text(encoding="utf-8"))["from"]
    return read_gains(path, arm()), f"searched on the filter `{origin['filter']}`"


def _row(cells: list[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _lines(head: list[str], rows: list[list[str]]) -> str:
    return "\n".join([_row(head), "|" + "---|" * len(head), *map(_row, rows)])


def _never(value: float | None, digits: int = 2) -> str:
    return "never" if value is None else f"{value:.{digits}f}"


def _distance(one: dict[str, Any]) -> str:
    """Of the loops that settle."""
    return f"{_never(one['median'])} / {_never(one['worst'])}"


def _met(one: dict[str, Any]) -> str:
    return f"{100.0 * one['met'] / one['loops']:.1f} %"


def table(results: dict[str, Any]) -> str:
    """A row a controller."""
    head = ["controller", "gains", "met, filter", "settled, filter", "median / worst settling, s", "worst overshoot, °"]
    head += ["worst steady error, °", "too late / too far / too wrong, loops"]
    head += ["settling over the least time under 10 V, median / worst", "never settled / out of reach, loops"]
    head += ["own limit, V", "over the least time under it, median / worst / out of reach"]
    head += ["met, true state", f"met, filter `{NOMINAL}`"]
    rows = []
    for name, one in results.items():
        seen, nominal = one["filter"], one.get("nominal_filter")
        full, own = seen["over_least_time"], seen["over_least_time_under_own_limit"]
        rows.append(
            [
                name,
                one["gains"],
                _met(seen),
                f"{100.0 * seen['settled'] / seen['loops']:.1f} %",
                f"{_never(seen['median_settling_s'])} / {_never(seen['worst_settling_s'])}",
                f"{seen['worst_overshoot_deg']:.1f}",
                f"{seen['worst_steady_error_deg']:.2f}",
                " / ".join(map(str, seen["beyond"].values())),
                _distance(full),
                f"{full['never']} / {full['unreachable']}",
                f"{own['limit_V']:.3g}",
                f"{_distance(own)} / {own['unreachable']}",
                _met(one["true_state"]),
                "" if nominal is None else _met(nominal),
            ]
        )
    return _lines(head, rows)


def frontier_table(frontier: dict[str, Any]) -> str:
    """A row a set of gains."""
    head = [
        "gains",
        "met",
        "settling over the least time, median / worst",
        "median / worst settling, s",
        "worst overshoot, °",
    ]
    rows = [
        [
            name,
            _met(one),
            _distance(one["over_least_time"]),
            f"{_never(one['median_settling_s'])} / {_never(one['worst_settling_s'])}",
            f"{one['worst_overshoot_deg']:.1f}",
        ]
        for name, one in frontier.items()
    ]
    return _lines(head, rows)


def _search_again(names: list[str], quick: float, seed: int) -> None:
    for name in names:
        start, _ = gains_of(name)
        box = list(box_of(name))
        whole = dict(zip(box, map(float, get_parameters(start.put(arm()), box)), strict=True))
        gains = Gains(name, searched(name, whole, seed=seed, quick=quick))
        more = {"by": "studies.requirement.search", "filter": FILTER, "weight of the settling time": quick}
        write_gains(GAINS / f"{name}.json", gains, gains.units(arm()), more)


def main(arguments: list[str]) -> None:
    """Search what is asked for, judge all, write."""
    prepare(cores=True)
    if "--search" in arguments:
        quick = float(arguments[arguments.index("--quick") + 1]) if "--quick" in arguments else 0.0
        seed = int(arguments[arguments.index("--seed") + 1]) if "--seed" in arguments else 0
        _search_again([one for one in arguments if one in CONTROLLERS], quick, seed)
    named = [name for name in arguments if name in CONTROLLERS]
    if "--fresh" in arguments:
        _judge_afresh(named, int(arguments[arguments.index("--fresh") + 1]))
        return
    rows, system = judged_on(), arm()
    between, nominal = (interface_of(system, one, NOISE, PERIOD, STEP, DELAY, QUANTUM) for one in (FILTER, NOMINAL))
    results = json.loads((HERE / "results.json").read_text(encoding="utf-8")) if named else {}
    for name in named or COMPARED:
        gains, origin = gains_of(name)
        one: dict[str, Any] = {
            "gains": origin,
            "true_state": judged(name, Interface(), rows, gains),
            "filter": judged(name, between, rows, gains),
        }
        if one["filter"]["met"] >= ASKED * len(rows):
            one["nominal_filter"] = judged(name, nominal, rows, gains)
        results.setdefault("controllers", {})[name] = one
        print(name, json.dumps(one), flush=True)
        if name == QUICKEST:
            results["frontier"] = {}
            for path in sorted(FRONTIER.glob("*.json")):
                other = judged(name, between, rows, read_gains(path, system))
                results["frontier"][path.stem.replace("_", " ")] = other
                print(path.stem, json.dumps(other), flush=True)
        _write(results)


def _judge_afresh(names: list[str], seed: int) -> None:
    """Print what the gains do on `FRESH` other plants, drawn with `seed`; nothing is written."""
    rows, between = drawn(FRESH, seed), interface_of(arm(), FILTER, NOISE, PERIOD, STEP, DELAY, QUANTUM)
    for name in names or COMPARED:
        one = judged(name, between, rows, gains_of(name)[0])
        print(f"{name}: {_met(one)} of {one['loops']} loops, beyond the limits {one['beyond']}", flush=True)


def _write(results: dict[str, Any]) -> None:
    in_order = {name: results["controllers"][name] for name in CONTROLLERS if name in results["controllers"]}
    results["controllers"] = in_order
    replace(HERE / "results.json", json_text(results))
    text = put((HERE / "README.md").read_text(encoding="utf-8"), MARK, table(in_order))
    replace(HERE / "README.md", put(text, FRONTIER_MARK, frontier_table(results.get("frontier", {}))))


if __name__ == "__main__":
    main(sys.argv[1:])
