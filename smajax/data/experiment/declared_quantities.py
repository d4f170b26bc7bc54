"""Outputs whose readings cannot be what they are declared to be: another column, or another quantity in its place."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
import scipy  # its parts are imported when they are first used

from smajax.data.experiment.catalogue import Scale
from smajax.data.experiment.signals import ReadRun

BELOW, ABOVE = (
    5.0,
    30.0,
)  # K from the air: a heated wire is never that much colder, and before it is heated not that much warmer
# A wire that the heat would warm by at least that many K, by the convection where the search starts, and the share of it that it warms by at the least.
WARMED, LEAST_SHARE = 20.0, 0.05
TIMES = (
    5.0  # a resistance over what length, diameter and resistivities say: more than leads and wrong resistivities make
)
COLUMN = "Is it the right column"


def ambient_of(read: ReadRun, scale: Scale) -> float:
    """Mean temperature of the air in the run, degC: as recorded, as the run says, or the model's."""
    if "ambient_temperature" in read.run.inputs:
        return float(np.mean(read.run.inputs["ambient_temperature"]))
    return read.run.parameters.get("ambient_temperature", scale.ambient)


def lagging(values: np.ndarray, step: float, time_constant: float) -> np.ndarray:
    """`values` (n,), `step` apart, as what follows them with that time constant shows them, from zero; both s."""
    share = 1.0 - np.exp(-step / time_constant)
    return np.asarray(scipy.signal.lfilter([share], [1.0, share - 1.0], values))


def warmings(runs: Sequence[ReadRun], scale: Scale, heats: Sequence[str], step: float) -> list[np.ndarray]:
    """By run, (n,): the degrees above the air of a wire that follows its heat through the time constant of its temperature; none where a heat is not recorded."""
    result = []
    for read in runs:
        given = {name: read.run.inputs[name] for name in heats if name in read.run.inputs}
        warm = scale.warming(given) if heats and len(given) == len(heats) else np.zeros(0)
        result.append(lagging(warm, step, scale.time_constant))
    return result


def _temperature(runs: Sequence[ReadRun], scale: Scale, heats: Sequence[str], step: float) -> list[str]:
    """A temperature of the wire begins at the air's, rises by heat, and does not fall below the air's."""
    readings = [
        (read, read.signals["temperature"].measured, warm)
        for read, warm in zip(runs, warmings(runs, scale, heats, step), strict=True)
        if read.signals["temperature"].measured.size
    ]
    if not readings:
        return []
    low = min(float(values.min()) for _, values, _ in readings)
    high = max(float(values.max()) for _, values, _ in readings)
    airs = [ambient_of(read, scale) for read, *_ in readings]
    what = (
        f"{COLUMN}, and a temperature in the unit that the file says? A resistance or a voltage is declared as what it is, in its own unit, "
        "or not at all"
    )
    got = f"the output 'temperature' lies between {low:.4g} and {high:.4g} degC in all runs"
    if high < min(airs) - BELOW:
        return [f"{got}, and a heated wire is never colder than the air, here {min(airs):.4g} degC. {what}"]
    warm_starts = any("initial_temperature" in read.run.parameters for read, *_ in readings)
    if low > max(airs) + ABOVE and not warm_starts:
        return [
            f"{got}, and a wire that is not heated has the temperature of the air, here {max(airs):.4g} degC. {what}"
        ]
    rise = max(float(np.ptp(values)) for _, values, _ in readings)
    expected = max((float(warm.max()) for *_, warm in readings if warm.size), default=0.0)
    if expected > WARMED and rise < LEAST_SHARE * expected:
        return [
            f"the output 'temperature' changes by {rise:.3g} K, and the heat would warm the wire by some {expected:.3g} K. {what}"
        ]
    return []


def _resistance(runs: Sequence[ReadRun], scale: Scale) -> list[str]:
    """The resistance of a wire of that length, diameter and resistivity."""
    readings = np.concatenate([read.signals["resistance"].measured for read in runs])
    least, most = scale.resistance
    if not readings.size or not least > 0.0:
        return []
    middle = float(np.median(readings))
    if least / TIMES < middle < TIMES * most:
        return []
    return [
        f"the output 'resistance' is {middle:.4g} ohm (median), and a wire of the model's length, diameter and resistivities has {least:.3g} "
        f"to {most:.3g} ohm. {COLUMN}, and in ohm? Else give `wire_length`, `wire_diameter` and resistivities of your wire in "
        "[model.parameters]; a resistance of other parts in series is not the wire's"
    ]


def _position(runs: Sequence[ReadRun], scale: Scale) -> list[str]:
    """A position counts from where the wire is at rest, and no wire contracts by its length."""
    most = max(
        (float(np.abs(values).max()) for read in runs if (values := read.signals["position"].measured).size),
        default=0.0,
    )
    if most <= scale.wire_length:
        return []
    return [
        f"the output 'position' reaches {most:.4g} m, more than the wire's length of {scale.wire_length:.3g} m; it counts from where the load "
        "rests on the cold wire. Is it in mm, is `wire_length` another, or has the sensor another zero? Then set offset = true under "
        "[channels.position]"
    ]


def quantity_warnings(
    runs: Sequence[ReadRun], scale: Scale, heats: Sequence[str], step: float, offset: Collection[str] = ()
) -> list[str]:
    """One sentence for each output that is not what it is declared to be. offset: outputs with a zero of their own in each run."""
    outputs = runs[0].run.outputs
    result = _temperature(runs, scale, heats, step) if "temperature" in outputs and heats else []
    result += _resistance(runs, scale) if "resistance" in outputs else []
    return result + (_position(runs, scale) if "position" in outputs and "position" not in offset else [])
