"""M5: under Liang's and Brinson's conditions the arm does not reach 85 degrees (Fig. 3.7-3.10)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from smajax.model.rigs import arm
from smajax.model.system import System

from .regulation import draw_regulation, to_85_degrees
from .rigs import austenite_range
from .row import Result, Row, State, judgement

LEAST = 0.1  # C: the wire cools by more than rounding


def judged(numbers: Mapping[str, float]) -> State:
    """The arm stalls with xi > 0 and T above A_f', which T passes while it falls, A_f' falling faster.

    "The rates of decrease ... are not equal; the SMA wire's temperature decays slower than the austenite final temperature,
    this way the wire's temperature - while decreasing - exceeded the austenite final temperature" (sec. 3.4): of the passing.
    That it falls from there on the text does not say; it says that "the voltage to the SMA wire was increased". As the claim is worded it falls on all of the stretch above A_f'.
    """
    checked = True
    for law in ("liang", "brinson"):
        checked &= numbers[f"{law}_end_deg"] < 84.0 and numbers[f"{law}_end_fraction"] > 0.01
        checked &= numbers[f"{law}_end_temperature_above_finish_C"] > 0.0
        checked &= numbers[f"{law}_missed_warming_C"] < -LEAST and numbers[f"{law}_crosses_cooling"] == 1.0
    whole = min(numbers[f"{law}_cooling_share_above_finish"] for law in ("liang", "brinson"))
    return judgement(checked, whole > 0.99)


class Passing(NamedTuple):
    """How the wire passes A_f': the first sample above it (None: no such one), and of each step whether it cools while A_f' falls faster."""

    crossing: int | None
    cooling: np.ndarray
    missed: np.ndarray  # those of them inside the range and up to the crossing, in which the law transforms nothing


def passing(system: System, stress: np.ndarray, fraction: np.ndarray, temperature: np.ndarray) -> Passing:
    """Of one run, arrays of shape (time,)."""
    start, finish = austenite_range(system, stress)
    beyond = np.flatnonzero((temperature > finish) & (fraction > 1e-3))
    crossing = int(beyond[0]) if beyond.size else None
    cooling = (np.diff(temperature) < 0.0) & (np.diff(temperature - finish) > 0.0)
    missed = cooling & (temperature > start)[1:]
    missed[crossing or 0 :] = False
    return Passing(crossing, cooling, missed)


def work(fast: bool) -> Result:
    """Sliding control to 85 degrees under each law."""
    loops = to_85_degrees(fast)
    numbers: dict[str, float] = {}
    for law in ("liang", "brinson"):
        run = loops[law].run
        finish = austenite_range(arm(law), run.stress)[1]
        found = passing(arm(law), run.stress, run.martensite_fraction, run.temperature)
        cooling, missed, crossing = found.cooling, found.missed, found.crossing or 0
        warmer, nearer = np.diff(run.temperature), np.diff(run.temperature - finish)
        dt = float(run.time[1] - run.time[0])
        # The stretch begins with the step in which T passes A_f', and lasts to the end of the run.
        stretch = np.arange(len(warmer)) >= crossing - 1
        numbers |= {
            f"{law}_end_deg": float(np.degrees(run.position[-1])),
            f"{law}_end_fraction": float(run.martensite_fraction[-1]),
            f"{law}_end_temperature_above_finish_C": float(run.temperature[-1] - finish[-1]),
            f"{law}_missed_seconds": float(missed.sum() * dt),
            f"{law}_crosses_cooling": float(found.crossing is not None and cooling[crossing - 1]),
            f"{law}_cooling_seconds_above_finish": float((stretch & cooling).sum() * dt),
            f"{law}_cooling_share_above_finish": float(cooling[stretch].mean()),
            f"{law}_warming_above_finish_C": float(run.temperature[-1] - run.temperature[crossing]),
            f"{law}_missed_warming_C": float(warmer[missed].sum()),
            f"{law}_missed_drive_C": float(nearer[missed].sum()),
        }
    tanaka = float(np.degrees(loops["tanaka"].run.position[-1]))
    return Result.of(
        judged(numbers),
        in_part=f"the wire cools where T passes A_f', as section 3.4 says, but dT/dt < 0 for {numbers['liang_cooling_seconds_above_finish']:.2g} s of the stretch above it alone, after which it heats",
        found=f"the arm stalls at {numbers['liang_end_deg']:.1f}° (Liang) and {numbers['brinson_end_deg']:.1f}° (Brinson) "
        f"with xi = {numbers['liang_end_fraction']:.2f} and T above A_f'; on its way there it cools by "
        f"{-numbers['liang_missed_warming_C']:.2f} °C in moments in which T - sigma/C_A rises by "
        f"{numbers['liang_missed_drive_C']:.1f} °C, the last of them the one in which T passes A_f'; above it the controller heats on, by "
        f"{numbers['liang_warming_above_finish_C']:.0f} °C, and nothing transforms",
        numbers={**numbers, "tanaka_end_deg": tanaka},
        draw=lambda figure: draw_regulation(figure, loops, "liang"),
        caveat="gains are not printed: one set for M5, M6, M8 and C11 to C13 (studies/unprinted). The wire cools only in moments, the last of which is the one in which T passes A_f': it ends "
        f"{numbers['liang_cooling_seconds_above_finish']:.2g} s, or {100 * numbers['liang_cooling_share_above_finish']:.2g} %, into the stretch above A_f'. Tanaka's law (beside the claim) ends at {tanaka:.0f}°: its "
        "range has no upper end, so that warming goes on transforming where Liang's is over.",
    )


ROW = Row(
    "M5",
    "Fig. 3.7-3.10",
    "arm, stress-based sliding control to 85°, Liang and Brinson conditions",
    "the arm does not reach 85°; T exceeds A_f' while xi > 0; on that stretch dT/dt < 0 and dT/dt - (dsigma/dt)/C_A > 0",
    work,
)
