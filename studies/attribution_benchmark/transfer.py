"""Fitted to steps, judged on runs of other kinds: does what the loop names hold where it was not fitted?

    python -m studies.attribution_benchmark.transfer --out OUT [--only TEXT] [--part 1/4] [--fast]

Nulls, and one effect of the library at three and ten noises, on wires whose values of the sheet are off as their widths say. Each case is fitted
by `close_loop` to the fit runs alone. Its averaged prediction of the judged runs stands beside the base model's and beside that of an
oracle, the true effect fitted to the same runs with all parameters. A file a case in OUT/scored: what is there is not made again.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import time as clock
import traceback
import zlib
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from smajax.core.files import replace
from studies.attribution_benchmark.cases import Case, true_wire
from studies.attribution_benchmark.effects import EFFECTS, absorbed, applies
from studies.attribution_benchmark.judge import called
from studies.attribution_benchmark.rigs import RIGS, Rig
from studies.attribution_benchmark.sheet import on_the_sheet
from studies.attribution_benchmark.strength import Ruler
from studies.attribution_benchmark.transfer_runs import kind_of, transfer_rig
from studies.attribution_benchmark.transfer_tables import text
from studies.attribution_benchmark.write import experiment_text, readings, table_text

NULLS, STRENGTHS = 4, (3.0, 10.0)
FRESH = 300  # of a case's number: wires that no other study draws
FAST_THINNED = 4  # samples of a coupon to one


@dataclass(frozen=True)
class JudgedRun:
    """Errors over the noise on one run that nothing was fitted to."""

    kind: str
    base: float
    average: float
    oracle: float | None  # None where the true effect could not be fitted
    coverage: float  # share of the samples in the 90 % band of the average
    samples: int


@dataclass(frozen=True)
class Transferred:
    """One case."""

    case: str
    rig: str
    truth: tuple[str, ...]
    strength: float  # that the steps show, noises after a refit
    verdict: str
    added: tuple[str, ...]
    seconds: float
    runs: tuple[JudgedRun, ...]


def transfer_cases(fast: bool = False) -> list[Case]:
    """In an order in which every beginning has all rigs and some of each kind; `fast`: of the coupon, ten noises."""
    found = [Case(rig, (), 0.0, FRESH + number) for rig in RIGS for number in range(NULLS)]
    for name, effect in EFFECTS.items():
        if effect.outside:
            continue
        for rig in RIGS:
            if applies(name, rig) and not absorbed(name, rig):
                found += [Case(rig, (name,), strength, FRESH + number) for number, strength in enumerate(STRENGTHS)]
    if fast:
        found = [case for case in found if case.rig == "coupon" and case.strength != STRENGTHS[0]]
    return sorted(found, key=lambda case: zlib.crc32(case.name.encode()))


def write_case(case: Case, out: Path, thinned: int = 1) -> tuple[Path, float]:
    """(folder, strength): fit.toml and judged.toml with their logs."""
    folder = out / case.name
    rig, wire = transfer_rig(case.rig, thinned), true_wire(case)
    known = folder / "truth.json"
    if known.exists():
        return folder, float(json.loads(known.read_text(encoding="utf-8"))["strength"])
    folder.mkdir(parents=True, exist_ok=True)
    effects, strength = _effects(case, rig)
    read = readings(rig, wire, effects, case.seed)
    runs = rig.runs(wire)
    for run in runs:
        (folder / f"{run.name}.csv").write_text(table_text(rig, run, read[run.name]), encoding="utf-8")
    judged = tuple(run for run in runs if run.role != "fit")
    fitted = tuple(run for run in runs if run.role == "fit")
    # Roles mean nothing where a model is held against runs, but an experiment has a fit run.
    as_fit = tuple(dataclasses.replace(run, role="fit") for run in judged)
    (folder / "fit.toml").write_text(experiment_text(rig, fitted), encoding="utf-8")
    (folder / "judged.toml").write_text(experiment_text(rig, as_fit), encoding="utf-8")
    values = {name: getattr(wire, name) for name in (*rig.unknowns, *on_the_sheet(rig))}
    replace(known, json.dumps({"effects": effects, "strength": strength, "parameters": values}))
    return folder, strength


def _effects(case: Case, rig: Rig) -> tuple[dict[str, float], float]:
    if not case.effects:
        return {}, 0.0
    (name,) = case.effects
    found = Ruler(rig, true_wire(case), on_the_sheet(rig)).find(name, case.strength)
    return {name: found.coefficient}, found.strength


def scored(case: Case, out: Path, thinned: int = 1, only: Sequence[str] | None = None) -> Transferred:
    """One case, fitted and judged. `only`: candidates, None for the whole library."""
    from smajax.attribution.close_loop import close_loop
    from smajax.data.experiment.load import load_experiment
    from smajax.data.model_catalogue import CATALOGUE
    from smajax.fit.predict import predict
    from studies.attribution_benchmark.oracle import oracle_errors

    folder, strength = write_case(case, out / "cases", thinned)
    experiment = load_experiment(folder / "fit.toml", CATALOGUE)
    judged = load_experiment(folder / "judged.toml", CATALOGUE)
    if only is not None:
        experiment = dataclasses.replace(experiment, effects_only=tuple(only))
    began = clock.monotonic()
    findings = close_loop(experiment)
    seconds = clock.monotonic() - began
    assert findings.extended_model is not None
    assert findings.base_model is not None
    average, base = (predict(model, judged).runs for model in (findings.extended_model, findings.base_model))
    known = json.loads((folder / "truth.json").read_text(encoding="utf-8"))["parameters"]
    options: list[tuple[str, ...]] = [(name,) for effect in case.effects for name in called(effect)] or [()]
    oracle = oracle_errors(experiment, judged, options, known)
    noise = findings.noise_sigma
    runs = tuple(
        JudgedRun(
            kind_of(one.name),
            other.series[0].rmse / noise,
            one.series[0].rmse / noise,
            None if oracle is None else oracle[one.name] / noise,
            one.series[0].coverage,
            len(one.time),
        )
        for one, other in zip(average, base, strict=True)
    )
    added = tuple(effect.name for effect in findings.added)
    return Transferred(case.name, case.rig, case.effects, strength, findings.verdict, added, seconds, runs)


def load(path: Path) -> Transferred:
    """One that was scored."""
    record = json.loads(path.read_text(encoding="utf-8"))
    runs = tuple(JudgedRun(**run) for run in record.pop("runs"))
    return Transferred(**{**record, "truth": tuple(record["truth"]), "added": tuple(record["added"])}, runs=runs)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", default="", help="a part of the cases' names")
    parser.add_argument("--part", default="1/1", help="every n-th case, as 2/4")
    parser.add_argument("--fast", action="store_true", help="coupons with every fourth sample")
    asked = parser.parse_args()
    from smajax.core.runtime import prepare

    prepare()
    first, _, of = asked.part.partition("/")
    todo = [case for case in transfer_cases(asked.fast) if asked.only in case.name][int(first) - 1 :: int(of)]
    folder = asked.out / "scored"
    folder.mkdir(parents=True, exist_ok=True)
    for number, case in enumerate(todo, 1):
        path = folder / f"{case.name}.json"
        if path.exists():
            continue
        try:
            one = scored(case, asked.out, FAST_THINNED if asked.fast else 1)
        except Exception:  # one case must not stop the others; it is reported and has no score
            print(f"[{number}/{len(todo)}] {case.name}: failed\n{traceback.format_exc()}", flush=True)
            continue
        replace(path, json.dumps(asdict(one), indent=1) + "\n")
        errors = ", ".join(f"{run.kind} {run.average:.2f} ({_short(run.oracle)})" for run in one.runs)
        print(
            f"[{number}/{len(todo)}] {case.name}: {one.verdict} {'+'.join(one.added)}; {errors}; {one.seconds:.0f} s",
            flush=True,
        )
    everything = [load(path) for path in sorted(folder.glob("*.json"))]
    if everything:
        table = text(everything)
        replace(asked.out / "transfer.md", table + "\n")
        print(table)


def _short(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


if __name__ == "__main__":
    main()
