"""K and K_1 of backstepping, approach II: one pair for Fig. 4.20 and 4.22 to 4.25 and for the ambient temperature (C15, C18, C20, C21).

What the text says, tried on a grid: the arm settles after an overshoot (Fig. 4.20); a wrong inertia "does not significantly
degrade" it (Fig. 4.23); a smaller h_c in the controller moves it less than required, a larger one over-actuates (Fig. 4.25).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from smajax.control.presets import printed_filter
from smajax.core.parameters import set_parameters
from studies.source.backstepping_runs import SECONDS, plant, runs
from studies.source.c15_backstepping_two import SHOWN
from studies.source.c18_wrong_inertia import IN_PROPORTION, RATIOS
from studies.source.c20_wrong_convection import believed as with_convection
from studies.source.c20_wrong_convection import judged as convection_is_as_said
from studies.source.unprinted import backstepping_searched

GRID = [(gain, other) for gain in (0.8, 1.0, 1.2, 1.4) for other in (20.0, 30.0, 50.0, 99.3)]  # K, K_1, 1/s
WRONG = (*RATIOS, 0.9, 1.1)
SENTENCES = ("settles_after_an_overshoot", "inertia_does_not_degrade", "convection_moves_it_less_and_more")
TARGET, LEAST, MOST = 20.0, 5.0, 1.0  # degrees: of the runs with a wrong inertia; of the overshoot and of its shift


def at(gain: float, other: float) -> dict[str, Any]:
    """What a pair does, and which of the sentences it fulfils."""
    system = plant()
    tuned = set_parameters(backstepping_searched(system), {"damping_gain": gain, "temperature_gain": other})
    believed = [set_parameters(tuned, {"inertia_ratio": ratio}) for ratio in WRONG]
    lanes = [tuned] * 3 + believed
    targets = [-20.0, 0.0, SHOWN] + [TARGET] * len(WRONG)
    _, one = runs([system] * len(lanes), lanes, targets, True)
    _, seen = runs([system], [tuned], [TARGET], True, estimator=printed_filter(system), noise=[0.0])
    overshoot, settling = np.degrees(one.overshoot), np.minimum(one.settling_time, 2.0 * SECONDS)
    true, less, more = (3 + WRONG.index(ratio) for ratio in (1.0, 0.9, 1.1))
    shift = {
        name: float(max(abs(values[less] - values[true]), abs(values[more] - values[true])))
        for name, values in (("overshoot_deg", overshoot), ("settling_s", settling))
    }
    said = {
        "settles_after_an_overshoot": bool(
            settling[:3].max() < SECONDS and overshoot[:3].min() > 1.0 and overshoot[2] > LEAST
        ),
        "inertia_does_not_degrade": bool(
            settling[3:].max() < SECONDS
            and shift["overshoot_deg"] < MOST
            and shift["settling_s"] < IN_PROPORTION * settling[true]
        ),
        "convection_moves_it_less_and_more": convection_is_as_said(with_convection(tuned, True)[1]),
    }
    return {
        "damping_gain": gain,
        "temperature_gain": other,
        "overshoot_deg": np.round(overshoot[:3], 2).tolist(),
        "settling_s": np.round(settling[:3], 2).tolist(),
        "largest_settling_with_wrong_inertia_s": round(float(settling[3:].max()), 2),
        **{f"shift_by_10_percent_of_inertia_{name}": round(value, 3) for name, value in shift.items()},
        "steady_error_with_printed_filter_deg": round(float(np.degrees(seen.steady_error[0])), 3),
        **said,
    }


def found() -> dict[str, Any]:
    """Of the pairs that fulfil every sentence, the one which the printed filter's states leave nearest to its set point."""
    tried = [at(*pair) for pair in GRID]
    whole = [one for one in tried if all(one[sentence] for sentence in SENTENCES)]
    best = min(whole, key=lambda one: one["steady_error_with_printed_filter_deg"])
    values = {name: best[name] for name in ("damping_gain", "temperature_gain")}
    fulfilled = {sentence: sum(one[sentence] for one in tried) for sentence in SENTENCES}
    return {"values": values, "fulfil_all": len(whole), "fulfil": fulfilled, "tried": tried}
