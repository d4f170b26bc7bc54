"""Close the loop on the cases, one after the other, and hold what it says against what is true.

    python -m studies.attribution_benchmark.run --out OUT [--only TEXT] [--strength 10] [--nulls 5] [--part 1/4]

Resumable: a case that has been judged is not done again. `--nulls K` takes K nulls of every rig at most, and `--part i/n`
every n-th case, for several machines. Cases of one rig follow each other: they share their programs.
"""

from __future__ import annotations

import argparse
import json
import time as clock
import traceback
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from studies.attribution_benchmark.cases import STRENGTHS, Case, cases, of_any_size
from studies.attribution_benchmark.judge import Judged, judge, load, save
from studies.attribution_benchmark.tables import written
from studies.attribution_benchmark.write import write


def chosen(
    only: str, strengths: Sequence[float], nulls: int, part: tuple[int, int], drawn: int = 0, sized: bool = True
) -> list[Case]:
    """The cases asked for, in their order. `nulls`: of each rig at most. `sized`: of a strength; else coefficients are drawn."""
    seen: Counter[str] = Counter()
    found = []
    every = cases(drawn, [one for one in dict.fromkeys(strengths) if one not in STRENGTHS])
    for case in every if sized else of_any_size(every):
        if only not in case.name or (case.kind != "null" and strengths and case.strength not in strengths):
            continue
        seen[f"{case.rig} {case.kind}"] += 1
        if case.kind == "null" and seen[f"{case.rig} null"] > nulls:
            continue
        found.append(case)
    return found[part[0] - 1 :: part[1]]


def closed(case: Case, out: Path) -> Judged:
    """One case written, run through the loop and scored."""
    from smajax.attribution.close_loop import close_loop
    from smajax.core.files import replace
    from smajax.data.experiment.load import load_experiment
    from smajax.data.model_catalogue import CATALOGUE
    from smajax.report.json_file import findings_to_json

    folder = out / "cases" / case.name
    if not folder.exists():
        write(case, out / "cases")
    truth = json.loads((out / "cases" / "truth" / f"{case.name}.json").read_text(encoding="utf-8"))
    experiment = load_experiment(folder / "experiment.toml", CATALOGUE)
    began = clock.monotonic()
    findings = close_loop(experiment, memory=None)
    seconds = clock.monotonic() - began
    report = findings_to_json(findings)
    (out / "reports").mkdir(exist_ok=True)
    replace(out / "reports" / f"{case.name}.json", json.dumps(report, indent=1))
    return judge(truth, report, seconds)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", default="", help="a part of the cases' names")
    parser.add_argument(
        "--strength",
        type=float,
        action="append",
        default=[],
        help="1, 3 or 10, or another of single effects; may be given again",
    )
    parser.add_argument("--nulls", type=int, default=30, help="of each rig")
    parser.add_argument("--part", default="1/1")
    parser.add_argument(
        "--drawn", type=int, default=0, help="1, 2, ...: the same cases with other wires, strengths and noise"
    )
    parser.add_argument(
        "--any-size",
        action="store_true",
        help="coefficients drawn in their ranges, in the place of strengths: quick to write",
    )
    asked = parser.parse_args()
    from smajax.core.runtime import prepare

    prepare()
    if any(one <= 0.0 for one in asked.strength):
        parser.error("--strength: got 0 or less, expected noises above 0")
    if asked.strength and asked.any_size:
        parser.error("--any-size: got a --strength as well; expected one of the two")
    first, _, of = asked.part.partition("/")
    todo = chosen(asked.only, asked.strength, asked.nulls, (int(first), int(of)), asked.drawn, sized=not asked.any_size)
    judged = asked.out / "judged"
    judged.mkdir(parents=True, exist_ok=True)
    for number, case in enumerate(todo, 1):
        path = judged / f"{case.name}.json"
        if path.exists():
            continue
        try:
            one = closed(case, asked.out)
        except Exception:  # one case must not stop the others; it is reported and has no score
            print(f"[{number}/{len(todo)}] {case.name}: failed\n{traceback.format_exc()}", flush=True)
            continue
        save(one, path)
        mark = "right" if one.right else "equation right" if one.equation_right else "wrong"
        print(
            f"[{number}/{len(todo)}] {case.name} ({one.strength:.2g}): {one.verdict} {'+'.join(one.added)} {mark}; "
            f"{one.held_out_before:.2f} -> {one.held_out_after:.2f}, {one.seconds:.0f} s",
            flush=True,
        )
    everything = [load(path) for path in sorted(judged.glob("*.json"))]
    if everything:
        print(written(everything, asked.out))


if __name__ == "__main__":
    main()
