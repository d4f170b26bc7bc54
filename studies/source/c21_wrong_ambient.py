"""C21: approach II in air that is warmer or colder than it believes (sec. 4.8.4)."""

from __future__ import annotations

import math

import jax.numpy as jnp
import numpy as np

from smajax.core.parameters import set_parameters

from .backstepping_runs import (
    ON_ITS_PLANT,
    degrees,
    draw_sweep,
    draw_voltages,
    on_heating_curve,
    plant,
    runs,
)
from .row import Result, Row
from .unprinted import backstepping

AIR = (15.0, 18.0, 20.0, 22.0, 25.0)  # C
BELIEVED, TARGET = 20.0, 20.0  # C, degrees


def work(fast: bool) -> Result:
    """One batch over the air's temperature, and beside it the wrong h_c that loses the same heat as the coldest air."""
    system = plant()
    tuned = backstepping(system)
    zero = jnp.zeros(())
    hot = float(on_heating_curve(system, jnp.asarray(math.radians(TARGET)), zero).wire.temperature)
    ratio = (hot - BELIEVED) / (hot - AIR[0])
    wrong = set_parameters(tuned, {"convection_coefficient": ratio * float(system.wire.heat.convection_coefficient)})
    plants = [set_parameters(system, {"ambient_temperature": air}) for air in AIR]
    loops, _ = runs([*plants, system], [tuned] * len(AIR) + [wrong], [TARGET] * (len(AIR) + 1), fast)
    end = degrees(loops)[:, -1]
    names = [*(f"air {air:g} °C" for air in AIR), f"{ratio:.3f} h_c believed"]
    return Result(
        holds=bool(
            (np.diff(end[:-1]) > 0.0).all()
            and end[0] < TARGET - 5.0
            and end[-2] > TARGET + 5.0
            and abs(end[2] - TARGET) < 0.5
            and abs(end[-1] - end[0]) < 0.2 * abs(end[0] - TARGET)
        ),
        found=f"the controller assumes {BELIEVED:.0f} °C; in air of {', '.join(f'{air:g}' for air in AIR)} °C the arm ends at "
        f"{', '.join(f'{e:.1f}°' for e in end[:-1])} (set point {TARGET:.0f}°); an h_c assumed {100.0 * (1.0 - ratio):.1f} % too low, which "
        f"misjudges the loss as much as air of {AIR[0]:g} °C does, ends at {end[-1]:.1f}°",
        numbers={
            **{f"end_air_{air:g}_C_deg": float(e) for air, e in zip(AIR, end[:-1], strict=True)},
            "end_equal_hc_deg": float(end[-1]),
        },
        draw=lambda figure: draw_sweep(figure, loops, names, TARGET, draw_voltages(loops, names)),
        caveat=f"{ON_ITS_PLANT}.",
    )


ROW = Row(
    "C21",
    "sec. 4.8.4",
    "arm, approach II, ambient temperature other than assumed",
    "the same kind of effect as a wrong h_c",
    work,
)
