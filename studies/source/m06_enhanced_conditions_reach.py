"""M6: under the enhanced conditions the same controller brings the arm to 85 degrees (Fig. 3.35, 3.36)."""

from __future__ import annotations

import numpy as np

from .regulation import draw_regulation, to_85_degrees
from .row import Result, Row


def work(fast: bool) -> Result:
    """The runs of M5, the enhanced one looked at."""
    loops = to_85_degrees(fast)
    run, old = loops["enhanced"].run, loops["liang"].run
    angle = np.degrees(run.position)
    error = float(np.abs(angle[run.time > 15.0] - 85.0).max())
    xi, before = float(run.martensite_fraction[-1]), float(old.martensite_fraction[-1])
    return Result(
        holds=error < 0.5 and xi < before,
        found=f"the arm ends at {angle[-1]:.2f}° with xi = {xi:.3f} instead of {before:.3f}; "
        f"its error after 15 s is {error:.1e}° at most",
        numbers={"end_deg": float(angle[-1]), "error_after_15_s_deg": error, "fraction": xi, "fraction_liang": before},
        draw=lambda figure: draw_regulation(figure, loops, "enhanced"),
    )


ROW = Row(
    "M6",
    "Fig. 3.35, 3.36",
    "arm, stress-based sliding control to 85°, enhanced conditions",
    "the arm reaches 85°; xi ends lower than in M5",
    work,
)
