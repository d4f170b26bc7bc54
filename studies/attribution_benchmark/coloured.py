"""Noise with a memory that nobody declared: coupons that lack nothing, and coupons that lack an effect.

    python -m studies.attribution_benchmark.coloured --out OUT [--seeds 3]

With `noise = "estimate"` the noise is read off neighbouring samples, which show its fast part alone. Of the first the loop
with its whole library has to say that nothing is missing, whatever the noise keeps of the sample before; of the second
no base fit may pass for such a noise. Resumable: what has been answered is in OUT/coloured.json.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.signal import lfilter

from smajax.experiment.record import Experiment
from studies.attribution_benchmark.cases import cases
from studies.attribution_benchmark.rigs import show
from studies.attribution_benchmark.write import write

NULL = "coupon-null-0-00"
MEMORIES = (0.3, 0.6, 0.8, 0.9, 0.95)  # share of the sample before
WARM_UP = 300


def filtered(folder: Path, seed: int, memory: float) -> Experiment:
    """The coupon that lacks nothing, its white noise put through a first-order filter, as large as declared, and estimated."""
    from smajax.catalogue import CATALOGUE
    from smajax.experiment.load import load_experiment

    case = next(case for case in cases() if case.name == NULL)
    true = write(case, folder)
    experiment = load_experiment(folder / NULL / "experiment.toml", CATALOGUE)
    random, sigma = np.random.default_rng(seed), experiment.noise_sigma
    shown = {run.name: show(true.rig, true.wire, run, {}) for run in true.rig.runs(true.wire)}
    runs = []
    for run in experiment.runs:
        drawn = random.normal(size=run.output.size + WARM_UP)
        noise = sigma * np.sqrt(1.0 - memory**2) * lfilter([1.0], [1.0, -memory], drawn)[WARM_UP:]
        runs.append(dataclasses.replace(run, outputs={experiment.output_name: shown[run.name] + noise}))
    return estimated(dataclasses.replace(experiment, runs=tuple(runs)))


def estimated(experiment: Experiment) -> Experiment:
    """The same where nobody gave the noise."""
    from smajax.measured.noise import estimate_noise

    sigma = float(np.median([estimate_noise(run.output, 0.0) for run in experiment.runs if run.role == "fit"]))
    (output,) = experiment.outputs
    output = dataclasses.replace(output, noise_sigma=sigma, noise_given=False, noise_how="estimated")
    return dataclasses.replace(experiment, outputs=(output,))


def lacking(folder: Path, name: str) -> Experiment:
    """A coupon that lacks an effect, its noise estimated, and no candidate to name for it."""
    from smajax.catalogue import CATALOGUE
    from smajax.experiment.load import load_experiment

    write(next(case for case in cases() if case.name == name), folder)
    experiment = load_experiment(folder / name / "experiment.toml", CATALOGUE)
    return dataclasses.replace(estimated(experiment), effects_only=())


def closed(experiment: Experiment) -> dict[str, Any]:
    """What the loop says: verdict, effects, what is left over the estimate, what such a filter keeps."""
    from smajax.close_loop import close_loop

    found = close_loop(experiment, apart=True)
    portrait = found.portrait_after
    return {
        "verdict": found.verdict,
        "added": [effect.name for effect in found.effects if effect.added],
        "ratio": portrait.ratio,
        "kept": portrait.kept,
    }


def asked(seeds: int) -> dict[str, Callable[[Path], Experiment]]:
    """Name -> how the experiment is made, by the folder it is written to."""
    todo: dict[str, Callable[[Path], Experiment]] = {}
    for memory in MEMORIES:
        for seed in range(seeds):
            todo[f"null-{memory:g}-{seed}"] = lambda folder, memory=memory, seed=seed: filtered(folder, seed, memory)  # type: ignore[misc]
    weak = [case for case in cases() if case.rig == "coupon" and case.kind == "single" and case.strength in (1.0, 3.0)]
    for case in weak[: 4 * seeds]:
        todo[case.name] = lambda folder, name=case.name: lacking(folder, name)  # type: ignore[misc]
    return todo


def table(answers: dict[str, Any]) -> str:
    """Both rates, row by row."""
    rows = [
        "| noise keeps of the sample before | cases | nothing is missing | left over the estimate |",
        "|---|---|---|---|",
    ]
    for memory in MEMORIES:
        these = [one for name, one in answers.items() if name.startswith(f"null-{memory:g}-")]
        if these:
            right = sum(one["verdict"] == "adequate" for one in these)
            left = [one["ratio"] for one in these]
            rows.append(f"| {memory:g} | {len(these)} | {right} | {min(left):.2f} to {max(left):.2f} |")
    wrong = _lacking(answers)
    passed = [one for one in wrong if one["kept"] > 0.0 and one["ratio"] > 1.1]
    rows += [
        "",
        f"Of {len(wrong)} coupons that lack an effect of one or three noises {len(passed)} pass for such a noise.",
    ]
    return "\n".join(rows)


def _lacking(answers: dict[str, Any]) -> Sequence[dict[str, Any]]:
    return [one for name, one in answers.items() if not name.startswith("null-")]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seeds", type=int, default=3, help="of each memory; four times as many that lack an effect")
    given = parser.parse_args()
    from smajax.report.files import replace
    from smajax.runtime import prepare

    prepare()
    given.out.mkdir(parents=True, exist_ok=True)
    kept = given.out / "coloured.json"
    answers: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else {}
    todo = asked(given.seeds)
    for number, (name, made) in enumerate(todo.items(), 1):
        if name not in answers:
            with TemporaryDirectory() as cases_of_this:
                answers[name] = closed(made(Path(cases_of_this)))
            replace(kept, json.dumps(answers, indent=1))
        print(f"[{number}/{len(todo)}] {name}: {answers[name]}", flush=True)
    print(table(answers))


if __name__ == "__main__":
    main()
