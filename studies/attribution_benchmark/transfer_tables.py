"""Tables of the transfer study."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from studies.attribution_benchmark.transfer_runs import KINDS

if TYPE_CHECKING:
    from studies.attribution_benchmark.transfer import JudgedRun, Transferred

NEAR_ORACLE, WORSE = 1.2, 1.02  # over the oracle's error; over the base model's


def _share(runs: Sequence[JudgedRun], holds: Callable[[JudgedRun], bool]) -> str:
    count = sum(holds(run) for run in runs)
    return f"{count} of {len(runs)} ({count / len(runs):.0%})" if runs else "–"


def _near(run: JudgedRun) -> bool:
    """Whether the average comes near the oracle; also where there is none."""
    return run.oracle is None or run.average <= NEAR_ORACLE * run.oracle


def _worse(run: JudgedRun) -> bool:
    return run.average > WORSE * run.base


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def _row(name: str, runs: Sequence[JudgedRun]) -> str:
    """One line of the table: a judged run of a case is one of its cases."""
    compared = [run for run in runs if run.oracle is not None]
    ratios = [run.average / run.oracle for run in compared if run.oracle]
    covered = sum(run.coverage * run.samples for run in runs) / sum(run.samples for run in runs)
    middle = f"{np.median(ratios):.2f}, {np.quantile(ratios, 0.9):.2f}" if ratios else "–"
    gain = f"{np.median([run.average / run.base for run in runs]):.2f}"
    return f"| {name} | {len(runs)} | {_share(compared, _near)} | {middle} | {gain} | {_share(runs, _worse)} | {covered:.1%} |"


def text(cases: Sequence[Transferred]) -> str:
    """All cases by kind of run, and by what is missing."""
    head = (
        "| judged on | runs | at most 1.2 of the oracle's error | average over oracle: median, 90 % | over base model: median | "
        "worse than the base model | in the 90 % band |\n|---|---|---|---|---|---|---|"
    )
    every = [run for case in cases for run in case.runs]
    groups = {kind: [run for run in every if run.kind == kind] for kind in KINDS}
    groups["all"] = every
    groups["all, nothing missing"] = [run for case in cases if not case.truth for run in case.runs]
    groups["all, an effect missing"] = [run for case in cases if case.truth for run in case.runs]
    lines = [_row(name, runs) for name, runs in groups.items() if runs]
    far = [
        f"- {case.case}: {run.kind}, {run.average:.2f} noises, oracle {_number(run.oracle)}, base model {run.base:.2f}; "
        f"{case.verdict} {' + '.join(case.added)}"
        for case in cases
        for run in case.runs
        if not _near(run) or _worse(run)
    ]
    seconds = [case.seconds for case in cases]
    said = f"{len(cases)} cases; a loop took {np.median(seconds):.0f} s, the longest {max(seconds):.0f} s."
    listed = (
        ["", "Beyond 1.2 of the oracle's error, or worse than the base model by more than 2 %:", "", *far]
        if far
        else []
    )
    return "\n".join([said, "", head, *lines, *listed])
