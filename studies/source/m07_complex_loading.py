"""M7: stress falls while the temperature falls slowly, falls faster, or rests (Fig. 3.11 a, b, c)."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from smajax.model.rigs import coupon
from smajax.report.drawing import LAW_COLOURS, LAW_STYLES, keyed, named, panels

from .rigs import LAWS, austenite_range, simulated
from .row import Result, Row

COLD, POINT_1 = 23.0, 99.0  # C; point 1 lies in mid-range at 180 MPa: A_s' = 94.1, A_f' = 104.1
BEFORE, AFTER = 180e6, 100e6  # Pa: the fall moves the range by 11.6 C
POINT_2 = {
    "a: T falls slowly, past A_f'": 95.0,
    "b: T falls inside the range": 88.0,
    "c: T rests": POINT_1,
}


def work(fast: bool) -> Result:
    """Each law on each path: heated under constant stress to point 1, then to point 2."""
    samples = 200 if fast else 2000
    runs = {}
    for law in LAWS:
        system = coupon(law)
        for path, end in POINT_2.items():
            temperature = jnp.concatenate([jnp.linspace(COLD, POINT_1, samples), jnp.linspace(POINT_1, end, samples)])
            stress = jnp.concatenate([jnp.full(samples, BEFORE), jnp.linspace(BEFORE, AFTER, samples)])
            runs[law, path] = simulated(system, {"temperature": temperature, "stress": stress}, 1.0)
    fraction = {key: (run.martensite_fraction[samples - 1], run.martensite_fraction[-1]) for key, run in runs.items()}
    old = {key: abs(ends[1] - ends[0]) for key, ends in fraction.items() if key[0] in ("liang", "brinson")}
    further = {path: fraction["enhanced", path][0] - fraction["enhanced", path][1] for path in POINT_2}
    exact = {
        path: float(0.5 * (1 + np.cos(np.pi * np.clip((end - austenite_range(coupon(), AFTER)[0]) / 10.0, 0.0, 1.0))))
        for path, end in POINT_2.items()
    }
    reached = ", ".join(f"{fraction['enhanced', path][1]:.3f} ({path[0]})" for path in POINT_2)
    error = max(abs(fraction["enhanced", path][1] - exact[path]) for path in POINT_2)

    def draw(figure: Figure) -> None:
        for axes, path in zip(panels(figure, 1, 3), POINT_2, strict=True):
            for law in LAWS:
                run = runs[law, path]
                style: dict[str, Any] = {"color": LAW_COLOURS[law], "linestyle": LAW_STYLES[law], "label": law}
                axes.plot(run.temperature, run.martensite_fraction, **style)
                axes.plot(run.temperature[-1], run.martensite_fraction[-1], "o", color=LAW_COLOURS[law], markersize=4)
            for stress, colour in ((BEFORE, "#c7cbd1"), (AFTER, "#e3e5e9")):
                axes.axvspan(*austenite_range(coupon(), stress), color=colour, alpha=0.5, linewidth=0)
            axes.set_xlim(80.0, 108.0)
            named(axes, "temperature (°C)", "martensite fraction", path)
        keyed(figure.axes[0])

    return Result(
        holds=max(old.values()) == 0.0 and min(further.values()) > 0.01 and error < 1e-12,
        found="Liang and Brinson stay at xi = "
        f"{fraction['liang', 'c: T rests'][1]:.3f} from point 1 to point 2 on all three paths; the enhanced conditions "
        f"go on to {reached}",
        numbers={
            **{f"{law}_{path[0]}_end": float(ends[1]) for (law, path), ends in fraction.items()},
            "largest_error_against_closed_form": float(error),
        },
        draw=draw,
        caveat="the paths' end points are chosen here: the source's picture has no scale.",
    )


ROW = Row(
    "M7",
    "Fig. 3.11 a, b, c",
    "wire on prescribed (T, sigma) paths",
    "stress falls by the same amount: Liang and Brinson give the same xi at point 2 in all three cases, the enhanced "
    "model transforms further",
    work,
)
