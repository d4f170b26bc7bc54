"""`python -m studies.sweep.table`: the tables of `README.md`, from the `sweep.json` of each sweep of `run.py`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from smajax.control.presets import CONTROLLERS, with_printed_law
from smajax.core.files import replace
from studies.marked import put

HERE = Path(__file__).parent
MARK, OTHERS_MARK = "<!-- table -->", "<!-- others -->"
OTHERS = {"near": "convection and damping, 0.9 to 1.1", "inertia": "inertia 0.5 to 2, ambient -10 to +20 K"}
HEAD = (
    "controller",
    "plant",
    "unperturbed: settles at",
    "settling over least time, median / worst",
    "own largest command, V",
    "over least time with it",
    "perturbed: settles, of the runs in reach",
    "settling over least time, median / worst",
    "runs that never settle / of these out of reach of its own command / out of reach of all",
)


def times(found: dict[str, Any]) -> str:
    """Median and worst settling time over the least time, of the runs that settle."""
    return "never" if found["median"] is None else f"{found['median']:.2f} / {found['worst']:.2f}"


def table(record: dict[str, Any]) -> str:
    """A row a controller, nearest to the least time on the perturbed plants first among those that settle in as many runs, to a per cent."""
    rows = []
    for name, least in record["least_times"].items():
        nominal, own = (least[of]["settling_over_least_time"] for of in ("all_controllers", "controller"))
        perturbed, by_own = (
            record["sweep"]["settling_over_least_time"][name][of] for of in ("all_controllers", "controller")
        )
        in_reach = perturbed["settled"] + perturbed["never"]
        share = 100.0 * perturbed["settled"] / in_reach
        beyond = f", {nominal['unreachable']} out of reach" if nominal["unreachable"] else ""
        cells = [
            name,
            "eq. 4.51" if CONTROLLERS[name].section is with_printed_law else "chapter 3",
            f"{nominal['settled']} of {len(least['all_controllers']['seconds'])}{beyond}",
            times(nominal),
            f"{least['controller']['largest_command']:.3g}",
            times(own),
            f"{share:.0f} %",
            times(perturbed),
            f"{perturbed['never']} / {by_own['unreachable'] - perturbed['unreachable']} / {perturbed['unreachable']}",
        ]
        rows.append((-round(share), perturbed["median"], cells))
    lines = [HEAD, ["---"] * len(HEAD), *(cells for _, _, cells in sorted(rows))]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def others_table(records: dict[str, dict[str, Any]]) -> str:
    """A row a controller: share of the runs in reach that settle, and their settling time over the least time, in each of the `OTHERS`."""
    head = ["controller", *(f"{words}: {what}" for words in OTHERS.values() for what in ("settles", "over least time"))]
    lines = [head, ["---"] * len(head)]
    for name in next(iter(records.values()))["controllers"]:
        cells = [name]
        for folder in OTHERS:
            found = records[folder]["sweep"]["settling_over_least_time"][name]["all_controllers"]
            share = 100.0 * found["settled"] / (found["settled"] + found["never"])
            cells += [f"{share:.0f} %", times(found)]
        lines.append(cells)
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def record_of(folder: str) -> dict[str, Any]:
    """The record of a sweep of `run.py`, by its folder."""
    return json.loads((HERE / folder / "sweep.json").read_text(encoding="utf-8"))


def main() -> None:
    """Write them."""
    text = put((HERE / "README.md").read_text(encoding="utf-8"), MARK, table(record_of(".")))
    others = others_table({folder: record_of(folder) for folder in OTHERS})
    replace(HERE / "README.md", put(text, OTHERS_MARK, others))


if __name__ == "__main__":
    main()
