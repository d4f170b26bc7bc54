"""Tuning beside its peers, and the requirement for every controller: `python -m studies.tuning.run [--fast] [part ...]`.

Parts: `peers` and the controllers by name; default all (an hour on two cores). `--fast`: some minutes, into
`fast.json`. What is finished is kept in `results.json`; a part that is named is made again.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

from smajax.control.presets import OF_THE_SOURCE
from smajax.core.files import replace
from smajax.core.progress import Event, Message, Progress
from smajax.core.runtime import prepare
from smajax.model.rigs import arm
from studies.tuning.peers import PROBLEMS, Problem, searched
from studies.tuning.picture import draw
from studies.tuning.record import HERE, keep, kept
from studies.tuning.requirement import Plan, requirement
from studies.tuning.tables import readme

CANDIDATES = 100  # closed loops of a search: so many candidates on all members
SEEDS = tuple(range(5))
WAYS = {"trust-region": SEEDS, "adam": SEEDS, "nelder-mead": SEEDS, "cma-es": SEEDS, "grid": (0,)}
FAST_PROBLEM = Problem("vsc3", "worst", (0.0, 30.0), varied=False, seconds=3.0)
FAST_WAYS = {way: (0,) for way in WAYS}
FAST_PLAN = Plan((0.0, 30.0), 30.0, 4, 2, 3, 2, 4, 8, 1, 3.0)


def say(event: Event) -> None:
    """Progress as lines of a log."""
    if isinstance(event, Message):
        print(event.text, flush=True)


def compare(
    path: Path,
    problems: tuple[Problem, ...],
    candidates: int,
    again: bool,
    seeds_of: Mapping[str, tuple[int, ...]] = WAYS,
    progress: Progress = say,
) -> None:
    """Every way on every problem, stored one by one."""
    for problem in problems:
        loops = len(problem.set_points) * (9 if problem.varied else 1)
        for way, seeds in seeds_of.items():
            for seed in seeds:
                name = f"{problem.name}; {way}; {seed}"
                if name in kept(path).get("peers", {}) and not again:
                    continue
                result = searched(arm(), problem, way, candidates * loops, seed)
                keep(path, "peers", name, result)
                progress(Message(f"{name}: cost {result['course'][-1][1]:.4g} in {result['closed_loops']} loops"))


def require(path: Path, names: list[str], plan: Plan, again: bool, progress: Progress = say) -> None:
    """The requirement for every controller of `names`."""
    for name in names:
        if name in kept(path).get("requirement", {}) and not again:
            continue
        result = requirement(arm(), name, plan, progress, keep=path.name == "results.json")
        keep(path, "requirement", name, result)
        progress(Message(f"{name}: {'met' if result['met'] else 'not met'}, {result['limit_exceeded_by_share']}"))


def main(arguments: list[str]) -> None:
    """The parts asked for."""
    fast = "--fast" in arguments
    parts = [part for part in arguments if part != "--fast"]
    unknown = [part for part in parts if part not in ("peers", "picture", *OF_THE_SOURCE)]
    if unknown:
        raise SystemExit(f"no part {', '.join(unknown)}; there are peers, picture, {', '.join(OF_THE_SOURCE)}.")
    prepare(cores=True)
    path = HERE / ("fast.json" if fast else "results.json")
    if not parts or "peers" in parts:
        compare(
            path,
            (FAST_PROBLEM,) if fast else PROBLEMS,
            12 if fast else CANDIDATES,
            bool(parts),
            FAST_WAYS if fast else WAYS,
        )
    names = [part for part in parts if part in OF_THE_SOURCE] or ([] if parts else list(OF_THE_SOURCE))
    require(path, ["vsc3"] if fast and names else names, FAST_PLAN if fast else Plan(), bool(parts))
    if not fast:
        results, words = kept(path), (HERE / "words.md").read_text(encoding="utf-8")
        (HERE / "tuning.png").write_bytes(draw(results))
        replace(HERE / "README.md", readme(results, words))


if __name__ == "__main__":
    main(sys.argv[1:])
