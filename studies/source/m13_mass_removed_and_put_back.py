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
    """Up, and a net shortening, which the old conditions do not leave; as worded it is the measured one, at 16 V."""
    lifted = [value for name, value in numbers.items() if name.startswith("lifted_")]
    checked = min(lifted) > 0.0 and min(numbers[f"net_{case}_mm"] for case in CASES) > 0.1
    checked &= max(abs(numbers[f"net_96 g_{law}_mm"]) for law in ("liang", "brinson")) < 0.02
    return judgement(checked, abs(numbers["net_96 g_mm"] - MEAN) < NEAR * MEAN)


def work(fast: bool) -> Result:
    """Four ways of taking mass off at 16 V; all four laws for 96 g; and 96 g at several voltages."""
    lanes = [(case, VOLTS) for case in CASES]
    (rise, fraction, *_), before, mass, time = unloaded("enhanced", fast, *lanes)
    shift = 1e3 * (rise - rise[:, [before]])
    net = dict(zip(CASES, net_deflection(rise, before).tolist(), strict=True))
    (swept, swept_fraction, *_), at, _, _ = unloaded("enhanced", fast, *(("96 g", volts) for volts in SWEPT))
    over = net_deflection(swept, at)
    lifted = {case: float(shift[k, np.flatnonzero(mass[k] == mass[k].min())[-1]]) for k, case in enumerate(CASES)}
    laws = {law: unloaded(law, fast, ("96 g", VOLTS))[0][0] for law in LAWS}
    by_law = {law: float(net_deflection(one, before)[0]) for law, one in laws.items()}

    def draw(figure: Figure) -> None:
        left, right, curve, heights = panels(figure, 2, 2)
        curve.plot(SWEPT, over, "o-", color=BLUE)
        curve.axhspan(min(MEASURED), max(MEASURED), color=RED, alpha=0.25, label="measured, at 16 V")
        keyed(curve)
        named(curve, "voltage (V)", "net shortening (mm)", "96 g, enhanced, by voltage")
        heights.plot(swept_fraction[:, at], over, "o-", color=BLUE)
        named(heights, "martensite fraction before the change", "net shortening (mm)", "the same over the fraction")
        for k, case in enumerate(CASES):
            left.plot(time, shift[k], label=case, linewidth=1.2)
        for law, one in laws.items():
            style: dict[str, Any] = {"color": LAW_COLOURS[law], "linestyle": LAW_STYLES[law], "label": law}
            right.plot(time, 1e3 * (one[0] - one[0, before]), **style)
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
        "fraction_before": float(fraction[0, before]),
    }
    return Result.of(
        judged(numbers),
        in_part=f"the net shortening for 96 g is {net['96 g']:.2f} mm, where {MEAN:.2f} mm were measured",
        found=f"net shortening at {VOLTS:g} V: {', '.join(f'{value:.2f} mm ({case})' for case, value in net.items())}; measured for 96 g: "
        f"{', '.join(map(str, MEASURED))} mm; Liang's and Brinson's conditions leave {by_law['liang']:.3f} and "
        f"{by_law['brinson']:.3f} mm",
        numbers=numbers,
        draw=draw,
        caveat="amplifier, heat loss and evenness of the temperature are those of M11, M12 and M14, one set of three values for three quoted numbers, of which two are of eq. 3.16 (studies/unprinted): the size for 96 g "
        "and the fraction before the change are fitted, the sizes for 192 and 288 g (not printed), the signs and the old laws' zeros are not. "
        f"By voltage: {', '.join(f'{abs(value):.2f} mm at {volts:g} V' for volts, value in zip(SWEPT, over, strict=True))}. {100 * numbers['fraction_before']:.1f} % martensite are left before the change; "
        "with one temperature along the wire 16 V leave none, and no net shortening.",
    )


ROW = Row(
    "M13",
    "Fig. 3.24-3.33, eq. 3.16",
    "dead weight, 16 V, mass minus 96, 192, 288 g and back",
    "removing mass lifts further, putting it back leaves a net shortening (0.32, 0.27, 0.28 mm for 96 g); Liang and "
    "Brinson conditions leave none",
    work,
)
