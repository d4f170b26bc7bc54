"""Autocorrelated noise that was not declared: coupons that lack nothing, and coupons that lack an effect.

    python -m studies.attribution_benchmark.coloured --out OUT [--seeds 3] [--every 4]

With `noise = "estimate"` the noise is read off neighbouring samples, which show its fast part alone. Of the first the loop
with its whole library has to say that nothing is missing, whatever the noise keeps of the sample before; of the second that
something is, though a slow trace in a short log (`--every` so manieth sample) looks much like a slow noise. Resumable: what
has been answered is in OUT/coloured.json.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.signal import lfilter

from smajax.data.experiment.record import Experiment
from studies.attribution_benchmark.cases import cases
from studies.attribution_benchmark.rigs import show
from studies.attribution_benchmark.write import write

NULL = "coupon-null-0-00"
MEMORIES = (0.3, 0.6, 0.8, 0.9, 0.95)  # share of the sample before
WEAK = (1.0, 3.0)  # strengths of what is lacking, in noises
WARM_UP = 300


def filtered(folder: Path, name: str, seed: int, memory: float, every: int) -> Experiment:
    """A coupon, its white noise put through a first-order filter, as large as declared, and estimated."""
    from smajax.data.experiment.load import load_experiment
    from smajax.data.model_catalogue import CATALOGUE

    case = next(case for case in cases() if case.name == name)
    true = write(case, folder)
    experiment = load_experiment(folder / name / "experiment.toml", CATALOGUE)
    random, sigma = np.random.default_rng(seed), experiment.noise_sigma
    shown = {run.name: show(true.rig, true.wire, run, true.effects)[::every] for run in true.rig.runs(true.wire)}
    runs = []
    for run in experiment.runs:
        drawn = random.normal(size=shown[run.name].size + WARM_UP)
        noise = sigma * np.sqrt(1.0 - memory**2) * lfilter([1.0], [1.0, -memory], drawn)[WARM_UP:]
        inputs = {channel: values[::every] for channel, values in run.inputs.items()}
        outputs = {experiment.output_name: shown[run.name] + noise}
        runs.append(dataclasses.replace(run, time=run.time[::every], inputs=inputs, outputs=outputs))
    return estimated(dataclasses.replace(experiment, step=every * experiment.step, runs=tuple(runs)))


def estimated(experiment: Experiment) -> Experiment:
    """The same without a declared noise."""
    from smajax.data.readers.noise import estimate_noise

    sigma = float(np.median([estimate_noise(run.output, 0.0) for run in experiment.runs if run.role == "fit"]))
    (output,) = experiment.outputs
    output = dataclasses.replace(output, noise_sigma=sigma, noise_given=False, noise_how="estimated")
    return dataclasses.replace(experiment, outputs=(output,))


def closed(experiment: Experiment) -> dict[str, Any]:
    """What the loop says: verdict, effects, what is left over the estimate, what such a filter keeps."""
    from smajax.attribution.close_loop import close_loop

    found = close_loop(experiment)
    residual = found.residual_after
    return {
        "verdict": found.verdict,
        "added": [effect.name for effect in found.effects if effect.added],
        "ratio": residual.ratio,
        "kept": residual.filter_coefficient,
    }


def asked(seeds: int, every: int) -> dict[str, Callable[[Path], Experiment]]:
    """Name -> how the experiment is made, by the folder it is written to."""
    todo: dict[str, Callable[[Path], Experiment]] = {}
    for memory in MEMORIES:
        for seed in range(seeds):
            todo[f"null-{memory:g}-{seed}"] = partial(filtered, name=NULL, seed=seed, memory=memory, every=every)
    weak = [case for case in cases() if case.rig == "coupon" and case.kind == "single" and case.strength in WEAK]
    for case in weak[: 4 * seeds]:
        for memory in (0.0, 0.5):
            todo[f"{case.name}-{memory:g}"] = partial(filtered, name=case.name, seed=0, memory=memory, every=every)
    return todo


def table(answers: dict[str, Any]) -> str:
    """How often the loop is right of both, row by row."""
    rows = [
        "| noise keeps of the sample before | lacks | cases | says so | left over the estimate |",
        "|---|---|---|---|---|",
    ]
    for memory in MEMORIES:
        these = [one for name, one in answers.items() if name.startswith(f"null-{memory:g}-")]
        rows += _row(f"{memory:g}", "nothing", these, lambda one: one["verdict"] == "adequate")
    for slow in ("0", "0.5"):
        for strength in WEAK:
            these = [
                one
                for name, one in answers.items()
                if not name.startswith("null-") and name.endswith(f"-{slow}") and f"-{strength:g}-" in name
            ]
            lacks = f"an effect of {strength:g} noise{'s' if strength > 1 else ''}"
            rows += _row(slow, lacks, these, lambda one: one["verdict"] != "adequate")
    return "\n".join(rows)


def _row(
    memory: str, lacks: str, these: Sequence[dict[str, Any]], right: Callable[[dict[str, Any]], bool]
) -> list[str]:
    if not these:
        return []
    left = [one["ratio"] for one in these]
    said = sum(right(one) for one in these)
    return [f"| {memory} | {lacks} | {len(these)} | {said} | {min(left):.2f} to {max(left):.2f} |"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seeds", type=int, default=3, help="of each memory; four times as many that lack an effect")
    parser.add_argument("--every", type=int, default=1, help="sample to keep: a shorter log")
    given = parser.parse_args()
    from smajax.core.files import replace
    from smajax.core.runtime import prepare

    prepare()
    given.out.mkdir(parents=True, exist_ok=True)
    kept = given.out / "coloured.json"
    answers: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else {}
    todo = asked(given.seeds, given.every)
    for number, (name, made) in enumerate(todo.items(), 1):
        if name not in answers:
            with TemporaryDirectory() as cases_of_this:
                answers[name] = closed(made(Path(cases_of_this)))
            replace(kept, json.dumps(answers, indent=1))
        print(f"[{number}/{len(todo)}] {name}: {answers[name]}", flush=True)
    print(table(answers))


if __name__ == "__main__":
    main()
