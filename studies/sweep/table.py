"""`python -m studies.sweep.table`: the table of `README.md`, from what `smajax sweep --out studies/sweep` wrote to `sweep.json`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from smajax.control.presets import CONTROLLERS, with_printed_law
from smajax.core.files import replace

HERE = Path(__file__).parent
MARK = "<!-- table -->"
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


def main() -> None:
    """Write it."""
    record = json.loads((HERE / "sweep.json").read_text(encoding="utf-8"))
    before, _, rest = (HERE / "README.md").read_text(encoding="utf-8").partition(MARK)
    _, _, after = rest.partition(MARK)
    replace(HERE / "README.md", f"{before}{MARK}\n\n{table(record)}\n\n{MARK}{after}")


if __name__ == "__main__":
    main()
