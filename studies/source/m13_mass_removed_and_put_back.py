"""M13: mass taken off a partly transformed wire and put back leaves it shorter (Fig. 3.24-3.33, eq. 3.16)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from smajax.report.drawing import BLUE, LAW_COLOURS, LAW_STYLES, RED, keyed, named, panels

from .row import Result, Row, State, judgement
from .unloading import CASES, LAWS, SWEPT, VOLTS, net_deflection, unloaded

MEASURED = (0.32, 0.27, 0.28)  # mm, eq. 3.16, 96 g


MEAN = float(np.mean(MEASURED))
NEAR = 0.25  # of the measured net shortening


def judged(numbers: Mapping[str, float]) -> State:
    """Up, and a net shortening, which the old conditions do not leave; as worded it is the measured one at 16 V."""
    lifted = [value for name, value in numbers.items() if name.startswith("lifted_")]
    checked = min(lifted) > 0.0 and min(numbers[f"net_{case}_mm"] for case in CASES) > 0.1
    checked &= abs(numbers["net_96 g_mm"] - MEAN) < NEAR * MEAN
    checked &= max(abs(numbers[f"net_96 g_{law}_mm"]) for law in ("liang", "brinson")) < 0.02
    return judgement(checked, abs(numbers["net_96 g_16_V_mm"] - MEAN) < NEAR * MEAN)


def work(fast: bool) -> Result:
    """Four ways of taking mass off; all four laws for 96 g; and 96 g at several voltages."""
    lanes = [(case, VOLTS) for case in CASES]
    runs, before, mass = unloaded("enhanced", fast, *lanes)
    shift = 1e3 * (runs.position - runs.position[:, [before]])
    net = dict(zip(CASES, net_deflection(runs, before).tolist(), strict=False))
    swept, at, _ = unloaded("enhanced", fast, *(("96 g", volts) for volts in SWEPT))
    over = net_deflection(swept, at)
    at_16 = float(over[-1])
    lifted = {case: float(shift[k, np.flatnonzero(mass[k] == mass[k].min())[-1]]) for k, case in enumerate(CASES)}
    laws = {law: unloaded(law, fast, ("96 g", VOLTS))[0] for law in LAWS}
    by_law = {law: float(net_deflection(run, before)[0]) for law, run in laws.items()}

    def draw(figure: Figure) -> None:
        left, right, curve, heights = panels(figure, 2, 2)
        curve.plot(SWEPT, over, "o-", color=BLUE)
        curve.axhspan(min(MEASURED), max(MEASURED), color=RED, alpha=0.25, label="measured, at 16 V")
        curve.set_xscale("log")
        curve.set_xticks([5, 5.5, 6, 8, 16], ["5", "5.5", "6", "8", "16"])
        curve.minorticks_off()
        keyed(curve)
        named(curve, "voltage (V)", "net shortening (mm)", "96 g, enhanced, by voltage")
        heights.plot(swept.martensite_fraction[:, at], over, "o-", color=BLUE)
        named(heights, "martensite fraction before the change", "net shortening (mm)", "the same over the fraction")
        for k, case in enumerate(CASES):
            left.plot(runs.time[k], shift[k], label=case, linewidth=1.2)
        for law, run in laws.items():
            style: dict[str, Any] = {"color": LAW_COLOURS[law], "linestyle": LAW_STYLES[law], "label": law}
            right.plot(run.time[0], 1e3 * (run.position[0] - run.position[0, before]), **style)
        for axes, title, end in ((left, "enhanced, by mass removed", None), (right, "96 g, by law", 100.0)):
            axes.set_xlim(35.0, end)
            axes.set_ylim(-1.0, None)
            keyed(axes)
            named(axes, "time (s)", "position against before the change (mm)", title)

    numbers = {
        **{f"net_{case}_mm": value for case, value in net.items()},
        **{f"lifted_{case}_mm": value for case, value in lifted.items()},
        **{f"net_96 g_{law}_mm": value for law, value in by_law.items()},
        **{f"net_96 g_{volts:g}_V_mm": float(value) for volts, value in zip(SWEPT, over, strict=True)},
    }
    state = judged(numbers)
    return Result(
        holds=state is not State.FAILS,
        in_part=f"the size is tuned by the voltage: for 96 g the net shortening is "
        f"{', '.join(f'{abs(value):.2f} mm at {volts:g} V' for volts, value in zip(SWEPT, over, strict=True))}; at the printed 16 V there is none"
        if state is State.IN_PART
        else "",
        found=f"net shortening {', '.join(f'{value:.2f} mm ({case})' for case, value in net.items())}; measured for 96 g: "
        f"{', '.join(map(str, MEASURED))} mm; Liang's and Brinson's conditions leave {by_law['liang']:.3f} and "
        f"{by_law['brinson']:.3f} mm",
        numbers=numbers,
        draw=draw,
        caveat=f"not at the printed 16 V but at {VOLTS} V: with the electrical scaling of M11 and a constant h_c, 16 V "
        f"transforms the wire to the end and leaves {abs(at_16):.2f} mm. The voltage is chosen so that xi before the change "
        "is the source's (0.011, eq. 3.22): the size for 96 g follows from that choice, the signs and the old laws' zeros do not. "
        "So little martensite is left that 96 g already transform all of it, and 192 and 288 g leave the same.",
    )


ROW = Row(
    "M13",
    "Fig. 3.24-3.33, eq. 3.16",
    "dead weight, 16 V, mass minus 96, 192, 288 g and back",
    "removing mass lifts further, putting it back leaves a net shortening (0.32, 0.27, 0.28 mm for 96 g); Liang and "
    "Brinson conditions leave none",
    work,
)
