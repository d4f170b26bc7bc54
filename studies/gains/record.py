"""A search for gains with its record: what was searched, over what, and what came out, as JSON beside the script."""

from __future__ import annotations

import json
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from smajax.control.controllers.base import AbstractController
from smajax.control.figures_of_merit import Merit
from smajax.control.gain_search import SearchSettings, merits_of, search_gains
from smajax.model.rigs import arm
from smajax.model.system import System
from smajax.model.types import Scalar

Cost = Callable[[Merit, float], Scalar]
HERE = Path(__file__).parent
STEP = 0.01  # s
EDGE = 0.02  # of the box, by logarithm


def or_never(time: Scalar, seconds: float) -> Scalar:
    """A time, or twice the run where it is never."""
    return jnp.where(jnp.isfinite(time), time, 2.0 * seconds)


# More than eight parameters: each is one line of the record, and of the scripts that are read beside it.
def searched(
    controller: AbstractController,
    box: Mapping[str, tuple[float, float]],
    targets_deg: Sequence[float],
    cost: Cost,
    *,
    system: System | None = None,
    seconds: float = 10.0,
    candidates: int = 128,
    rounds: int = 8,
    seed: int = 0,
) -> dict[str, Any]:
    """The record of one search, on the arm where no `system` is given, gains to three digits as the presets have them."""
    targets = [float(np.radians(angle)) for angle in targets_deg]
    plant = system or arm()
    result = search_gains(
        plant,
        controller,
        box,
        targets,
        SearchSettings(seconds, STEP, 1, candidates, rounds, seed),
        cost=cost,
    )
    gains = {name: float(f"{value:.3g}") for name, value in result.gains.items()}
    # What is recorded is what the preset does: the rounded gains, at a finer step than the search's.
    judged = merits_of(
        plant,
        controller,
        tuple(gains),
        jnp.asarray([list(gains.values())]),
        jnp.asarray(targets),
        SearchSettings(seconds, STEP / 2, 2),
    )
    one = jax.tree.map(operator.itemgetter(0), judged)
    costs = np.asarray(jax.vmap(lambda each: cost(each, seconds))(one))
    record = {
        "cost_is": (cost.__doc__ or "").strip(),
        "box": {name: list(bounds) for name, bounds in box.items()},
        "targets_deg": list(targets_deg),
        "seconds": seconds,
        "seed": seed,
        "tried": result.tried,
        "cost": round(result.cost, 4),
        "gains": gains,
        "at_the_edge_of_its_box": sorted(
            name
            for name, (low, high) in box.items()
            if min(gains[name] / low, high / gains[name]) < (high / low) ** EDGE
        ),
        "cost_of_the_rounded_gains_at_5_ms": round(float(costs.mean()), 4),
        "reach_time_s": np.round(np.asarray(one.reach_time), 2).tolist(),
        "settling_time_s": np.round(np.asarray(one.settling_time), 2).tolist(),
        "overshoot_deg": np.round(np.degrees(np.asarray(one.overshoot)), 2).tolist(),
        "steady_error_deg": np.round(np.degrees(np.asarray(one.steady_error)), 3).tolist(),
    }
    return record


def main(name: str, searches: Callable[[], dict[str, dict[str, Any]]]) -> None:
    """Run the searches of one controller, print them, and write `<name>.json`."""
    jax.config.update("jax_enable_x64", True)
    # A time that is never has no number in JSON; a list stays on its line.
    text = json.dumps(searches(), indent=2).replace("Infinity", '"never"')
    text = re.sub(r"\[[^\[\]]*\]", lambda result: f"[{' '.join(result[0][1:-1].split())}]", text)
    print(text)
    (HERE / f"{name}.json").write_text(text + "\n", encoding="utf-8")
