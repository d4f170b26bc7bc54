"""The study's README, from its numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from smajax.control.presets import OF_THE_SOURCE
from studies.tuning.requirement import LIMITS

FIFTH = 0.2
EQUAL = 1.01  # costs are equal within 1 %
LEVEL = 7.5  # of a cost
PEERS = ("adam", "cma-es", "nelder-mead", "grid")


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head), *("| " + " | ".join(row) + " |" for row in rows)]
    return "\n".join(lines)


def cost_after(result: Mapping[str, Any], loops: float) -> float:
    """The best cost of a search after so many closed loops; infinite before its first."""
    done = [cost for run, cost in result["course"] if run <= loops]
    return float(done[-1]) if done else np.inf


def by_problem(results: Mapping[str, Any]) -> dict[str, dict[str, list[Mapping[str, Any]]]]:
    """Problem -> way -> its searches, one a seed."""
    result: dict[str, dict[str, list[Mapping[str, Any]]]] = {}
    for name, one in results["peers"].items():
        problem, way, _ = name.split("; ")
        result.setdefault(problem, {}).setdefault(way, []).append(one)
    return result


def reached(ways: Mapping[str, list[Mapping[str, Any]]], peer: str, budget: float) -> bool:
    """The median seed of the trust region is, after a fifth of the loops, as low as the peer's after all."""
    own = np.median([cost_after(one, FIFTH * budget) for one in ways["trust-region"]])
    return bool(own <= EQUAL * np.median([cost_after(one, budget) for one in ways[peer]]))


def _shown(values: Sequence[float]) -> str:
    """The median, and from the least to the most where there are several."""
    middle = f"{np.median(values):.3g}"
    return middle if len(values) == 1 else f"{middle} ({min(values):.3g}–{max(values):.3g})"


def peers_table(results: Mapping[str, Any]) -> str:
    """A row a problem."""
    rows = []
    for problem, ways in by_problem(results).items():
        budget = max(one["closed_loops"] for several in ways.values() for one in several)
        cells = [problem, f"{budget:,}", _shown([cost_after(one, FIFTH * budget) for one in ways["trust-region"]])]
        cells.append(_shown([cost_after(one, budget) for one in ways["trust-region"]]))
        for peer in PEERS:
            mark = "**" if reached(ways, peer, budget) else ""
            cells.append(f"{mark}{_shown([cost_after(one, budget) for one in ways[peer]])}{mark}")
        rows.append(cells)
    head = ["problem", "loops", "trust region, a fifth", "trust region, all", "Adam", "CMA-ES", "Nelder-Mead", "grid"]
    return _table(head, rows)


def verdict(results: Mapping[str, Any]) -> str:
    """Where a fifth of the loops was enough, in a sentence a peer."""
    rows = []
    problems = by_problem(results)
    for peer in PEERS:
        lost = []
        for problem, ways in problems.items():
            budget = max(one["closed_loops"] for several in ways.values() for one in several)
            if not reached(ways, peer, budget):
                lost.append(problem)
        name = {"adam": "Adam", "cma-es": "CMA-ES", "nelder-mead": "Nelder-Mead", "grid": "the grid"}[peer]
        rows.append(
            f"- against {name}: {len(problems) - len(lost)} of {len(problems)} problems"
            + (f"; not on {'; '.join(lost)}" if 0 < len(lost) < len(problems) else "")
        )
    return "\n".join(rows)


def first_below(results: Mapping[str, Any]) -> str:
    """Closed loops until PID's worst case costs less than `LEVEL`, a number a seed."""
    ways = by_problem(results)["pid, worst, plants 20 % wrong"]
    rows = []
    for way, several in ways.items():
        firsts = [next((run for run, cost in one["course"] if cost < LEVEL), None) for one in several]
        rows.append(f"{way} {' / '.join('never' if one is None else f'{one:,}' for one in firsts)}")
    return f"{'; '.join(rows)} loops."


def requirement_table(results: Mapping[str, Any]) -> str:
    """A row a controller: what the worst loop does."""
    rows = []
    for name in OF_THE_SOURCE:
        if name not in results["requirement"]:
            continue
        one = results["requirement"][name]
        after, plant = one["after"], one["worst_plant"]
        cells = [name, "yes" if one["met"] else "no"]
        for part in ("after_at_the_corners", "after_on_plants_drawn", "after_on_the_plant_as_believed"):
            cells.append(f"{one[part]['loops_that_meet_all']:,} of {one[part]['loops']:,}")
        for term in LIMITS:
            worst, at = after[term]["worst"], after[term]["at_deg"]
            cells.append(f"{'never' if worst is None else f'{worst:.3g}'} ({at:g}°)")
        ratios = ", ".join(f"{ratio:g}" for ratio in plant["ratios"].values())
        cells.append(f"{plant['fails']} of {plant['of']} ({ratios})" if plant["fails"] else "none")
        cells.append(f"{one['before']['loops_that_meet_all']:,} of {one['before']['loops']:,}")
        cells.append(f"{one['closed_loops'] / 1e6:.2f}")
        rows.append(cells)
    head = [
        "controller",
        "met",
        "corners, at set points not tuned",
        "plants and set points drawn",
        "plant as believed",
        "worst settling, s",
        "worst overshoot, °",
        "worst steady error, °",
        "the corner that fails most (I, c, h_c)",
        "with the preset's gains",
        "loops of the search, millions",
    ]
    return _table(head, rows)


def finer_table(results: Mapping[str, Any]) -> str:
    """A row a controller that comes near: its worst loops at a finer step."""
    rows = []
    for name in OF_THE_SOURCE:
        again = results["requirement"].get(name, {}).get("again_at_a_finer_step")
        if again is None or again["failed_at_the_coarser_step"] == again["loops"]:
            continue
        rows.append(
            [
                name,
                f"{again['failed_at_the_coarser_step']} of {again['loops']}",
                f"{again['fail']}",
                f"{100 * again['worst_exceeded_by_share']:+.3g} %",
            ]
        )
    return _table(["controller", "of the worst loops fail at 5 ms", "at 1 ms", "the worst there, over its limit"], rows)


def seconds(results: Mapping[str, Any]) -> str:
    """What a search took, median over problems and seeds."""
    of: dict[str, list[float]] = {}
    for ways in by_problem(results).values():
        for way, several in ways.items():
            of.setdefault(way, []).extend(one["seconds"] for one in several)
    return ", ".join(f"{way} {np.median(several):.3g} s" for way, several in of.items())


def readme(results: Mapping[str, Any], words: str) -> str:
    """`words` with the tables put in where it names them."""
    parts = {
        "PEERS": peers_table,
        "VERDICT": verdict,
        "FIRST": first_below,
        "REQUIREMENT": requirement_table,
        "FINER": finer_table,
        "SECONDS": seconds,
    }
    for mark, made in parts.items():
        words = words.replace(f"<{mark}>", made(results))
    return words
