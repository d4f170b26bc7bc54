"""`python -m studies.time_optimal.run`: the least times of the arm, and `results.json` (some minutes)."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from smajax.control.least_time import least_reach_times
from smajax.core.files import json_text, replace
from smajax.core.runtime import prepare
from smajax.model.rigs import arm
from smajax.model.system import System
from studies.marked import put
from studies.time_optimal.bang import switched_voltage, switching_times
from studies.time_optimal.direct import PIECE, settled_directly

HERE = Path(__file__).parent
SET_POINTS = (-40.0, -10.0, 20.0, 50.0, 85.0)  # degrees
SWUNG_TO = (94.0,)  # degrees: above where all of the wire is transformed; the arm swings there and cannot stay
LIMITS = (10.0, 8.7)  # V, of the presets
SECONDS = 6.0
MARK = "<!-- table -->"


def settled(system: System, degrees: tuple[float, ...], limit: float) -> list[dict[str, Any]]:
    """Of each set point: the least time to reach it, and what switching and then direct optimisation settle in, s; None: unreachable."""
    reach = least_reach_times(system, np.radians(degrees), limit)
    rows: list[dict[str, Any]] = []
    for angle, least in zip(degrees, reach, strict=True):
        row: dict[str, Any] = {"set_point_deg": angle, "limit_V": limit, "reach_s": None}
        if np.isfinite(least):
            known, full, pause = switching_times(system, angle, limit, float(least), SECONDS)
            row |= {"reach_s": float(least), "settle_by_switching_s": known, "full_until_s": full, "pause_s": pause}
            if np.isfinite(known):
                start = switched_voltage(system, angle, limit, full, pause, SECONDS)
                directly, shares = settled_directly(system, angle, limit, float(least), known, start)
                voltages = [round(float(limit * share), 3) for share in shares]
                if np.isfinite(directly):
                    row |= {"settle_directly_s": directly, "samples_a_voltage": PIECE, "voltages": voltages}
        rows.append(row)
    return rows


def table(rows: list[dict[str, Any]]) -> str:
    """A row a set point and limit."""
    lines = [
        "| set point, ° | limit, V | there, s | settled, directly, s | settled, by switching, s | full voltage until, s | none for, s |",
        "|---|---|---|---|---|---|---|",
    ]

    def shown(row: dict[str, Any], name: str) -> str:
        if name == "settle_by_switching_s" and row["reach_s"] is not None and row.get(name) is None:
            return "never"
        return "–" if row.get(name) is None else f"{row[name]:.3f}"

    for row in rows:
        there = "unreachable" if row["reach_s"] is None else shown(row, "reach_s")
        names = ("settle_directly_s", "settle_by_switching_s", "full_until_s", "pause_s")
        cells = [f"{row['set_point_deg']:g}", f"{row['limit_V']:g}", there, *(shown(row, name) for name in names)]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def main(arguments: list[str]) -> None:
    """All limits; the results stay beside the script."""
    prepare(cores=True)
    limits = LIMITS[:1] if "--fast" in arguments else LIMITS
    rows = [row for limit in limits for row in settled(arm(), (*SET_POINTS, *SWUNG_TO), limit)]
    _write(rows)


def _write(rows: list[dict[str, Any]]) -> None:
    text = json_text({"rows": rows})
    replace(HERE / "results.json", text)
    rows = json.loads(text)["rows"]  # where what is never has no number
    page = HERE / "README.md"
    replace(page, put(page.read_text(encoding="utf-8"), MARK, table(rows)))


if __name__ == "__main__":
    main(sys.argv[1:])
