"""M11: the dead weight under 1 to 16 V, 30 s on and 30 s off (Fig. 3.18, 3.19)."""

from __future__ import annotations

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from smajax.model.rigs import dead_weight
from smajax.model.wire.form import RateForm
from smajax.report.drawing import BLUE, keyed, named, panels

from .rigs import simulated
from .row import Result, Row, State, judgement
from .uneven_wire import CUT, PIECES, current, hung, piece
from .unprinted import DEAD_WEIGHT

VOLTS = np.arange(1.0, 17.0)
MASS = 0.075  # kg
FULL_STROKE = 24.75e-3  # m, eq. 3.22


def judged(numbers: Mapping[str, float]) -> State:
    """Little at 4 V, much above, higher with every volt, the cycle closes; as worded from 4 V on up to 16 V."""
    checked = numbers["rise_4_V_mm"] < 0.05 * 24.75 and numbers["rise_6_V_mm"] > 0.25 * 24.75
    checked &= numbers["fraction_is_monotone"] == 1.0 and numbers["off_the_start_after_cooling_mm"] < 0.01
    checked &= abs(numbers["rise_16_V_mm"] / 24.75 - 1.0) < 0.25
    checked &= numbers["least_rise_per_volt_mm"] > 0.0
    return judgement(checked, numbers["volts_from_5_to_95_percent"] > 6.0)  # at least half of the source's range


def work(fast: bool) -> Result:
    """All voltages, each with all pieces of the wire."""
    dt = 0.05 if fast else 0.01
    half = round(30.0 / dt)
    on = np.concatenate([np.ones(half), np.zeros(half + 1)])
    position, fraction, hottest, _ = hung(VOLTS[:, None] * on, np.full((len(VOLTS), len(on)), MASS), dt)
    time = dt * np.arange(len(on))
    millimetres, end, left = 1e3 * position[:, half - 1], position[:, -1], fraction[:, half - 1]
    whole = piece()
    recovered = float(1e3 * whole.wire.wire_length * whole.wire.constitutive.recoverable_strain)
    rate_form = simulated(dead_weight(form=RateForm()), {"voltage": jnp.asarray(6.0 * on)}, dt)
    open_cycle = float(1e3 * np.abs(rate_form.position[-1]))
    rest = float(1e3 * np.abs(end).max())
    # Volts, between those tried by a straight line, from where 5 % is transformed to where 95 % is.
    first, last = (float(np.interp(-share, -left, VOLTS)) for share in (0.95, 0.05))

    def draw(figure: Figure) -> None:
        over_time, over_volts = panels(figure, 1, 2)
        for k, level in enumerate(VOLTS):
            shade = 0.25 + 0.75 * k / len(VOLTS)
            over_time.plot(time, 1e3 * position[k], color=BLUE, alpha=shade, linewidth=1)
            if level in (4.0, 5.0, 6.0, 7.0, 8.0, 16.0):
                over_time.annotate(f"{level:.0f} V", (15.0, 1e3 * position[k, half // 2]), fontsize=8, va="bottom")
        named(over_time, "time (s)", "rise of the mass (mm)")
        over_volts.plot(VOLTS, millimetres, "o-", color=BLUE, label="after 30 s on")
        over_volts.plot(VOLTS, 1e3 * end, "s", color="#9aa0a8", markersize=4, label="after 30 s off")
        over_volts.axhline(1e3 * FULL_STROKE, linestyle=":", color="#9aa0a8")
        keyed(over_volts)
        named(over_volts, "voltage (V)", "rise of the mass (mm)")

    numbers = {
        **{f"rise_{volt:.0f}_V_mm": float(value) for volt, value in zip(VOLTS, millimetres, strict=True)},
        **{f"fraction_{volt:.0f}_V": float(value) for volt, value in zip(VOLTS, left, strict=True)},
        "least_rise_per_volt_mm": float(np.diff(millimetres).min()),
        "fraction_is_monotone": float(np.all(np.diff(left) <= 1e-12)),
        "recoverable_mm": recovered,
        "off_the_start_after_cooling_mm": rest,
        "off_the_start_rate_form_mm": open_cycle,
        "volts_at_5_percent": first,
        "volts_at_95_percent": last,
        "volts_from_5_to_95_percent": last - first,
        "hottest_piece_C": float(hottest.max()),
        "current_4_V_A": float(current(np.asarray(4.0))),
        "current_16_V_A": float(current(np.asarray(16.0))),
    }
    return Result.of(
        judged(numbers),
        in_part=f"the transformation goes from 5 to 95 % between {first:.1f} and {last:.1f} V, where the source's goes on up to 16 V",
        found=f"{millimetres[3]:.2f} mm at 4 V, {millimetres[4]:.1f} mm at 5 V, {millimetres[7]:.1f} mm at 8 V, {millimetres[-1]:.1f} mm at 16 V, higher with every volt; "
        f"5 % is transformed at {first:.1f} V, 95 % at {last:.1f} V; eps_L l_0 = {recovered:.2f} mm, the rest is elastic and thermal; "
        f"at most {rest:.0e} mm from the start after cooling",
        numbers=numbers,
        draw=draw,
        caveat="amplifier, heat loss and evenness of the temperature are not printed; one set for M11 to M14, three values that meet three numbers which are quoted of them, within two limits of ours (studies/unprinted): gain "
        f"{DEAD_WEIGHT['amplifier_gain']:g}, largest current {DEAD_WEIGHT['largest_current']:g} A ({numbers['current_4_V_A']:.2f} A at 4 V, {numbers['current_16_V_A']:.2f} A at 16 V), "
        f"the heat that a piece of the wire keeps spread by {100 * DEAD_WEIGHT['unevenness']:.0f} % (a normal distribution, cut at {CUT:g} of its standard deviations; {PIECES} pieces). The hottest piece comes to {numbers['hottest_piece_C']:.0f} °C. With one temperature along "
        "the wire, power as V² and a constant h_c the rise is complete a volt after its onset. The integrated form of the constitutive law is used: under the rate "
        f"form a cycle of an even wire ends {open_cycle:.1f} mm off its start.",
    )


ROW = Row(
    "M11",
    "Fig. 3.18, 3.19",
    "dead weight, 75 g, 1 to 16 V, 30 s on, 30 s off",
    "above 4 V a significant rise, monotone in voltage, returning to the initial length; full stroke 24.75 mm",
    work,
)
