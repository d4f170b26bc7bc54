"""Whether an effect that is given a probability is there as often as that says.

    python -m studies.attribution_benchmark.reliability OUT [OUT ...] [--to FOLDER]

`OUT` are folders that `run` has written. Counted are the effects of nulls, singles, pairs and triples that were in a set of effects worth a fit; names of one true effect
(`judge.called`) exclude each other and count once, with the sum of their probabilities. True effects that were in no such set are counted by themselves.
Intervals take the effects for independent; those of one case compete, so they are somewhat wider in truth.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from smajax.core.files import replace
from studies.attribution_benchmark.judge import Judged, called, load

EDGES = (0.0, 0.01, 0.05, 0.2, 0.5, 0.8, 0.95, 0.999, 1.0)
LEVEL = 0.95  # of the intervals of a share (Clopper and Pearson 1934)


@dataclass(frozen=True)
class Given:
    """One effect of one case: the probability that it was given, and whether it is there."""

    case: str
    effect: str
    probability: float  # NaN of a true one that was in no set worth a fit
    there: bool


def given(one: Judged, report: Mapping[str, Any]) -> Iterator[Given]:
    """The effects of one case; of a true one all that the library calls so."""
    found = {
        effect["name"]: float(probability)
        for effect in report["effects"]
        if (probability := (effect["evidence"] or {}).get("posterior_probability")) is not None
    }
    for true in one.truth:
        own = [found.pop(name) for name in called(true) if name in found]
        yield Given(one.case, true, min(sum(own), 1.0) if own else math.nan, True)
    for name, probability in found.items():
        yield Given(one.case, name, min(probability, 1.0), False)


def read(folders: Sequence[Path]) -> list[Given]:
    """Of all cases in folders of `run`, but for effects outside the library."""
    result: list[Given] = []
    for folder in folders:
        for path in sorted((folder / "judged").glob("*.json")):
            one = load(path)
            if one.kind in ("null", "single") or one.several:
                report = json.loads((folder / "reports" / path.name).read_text(encoding="utf-8"))
                result.extend(given(one, report))
    return result


@dataclass(frozen=True)
class Bin:
    """Effects with probabilities from `low` to `high`."""

    low: float
    high: float
    count: int
    there: int
    mean: float  # of their probabilities
    interval: tuple[float, float]  # of the share that is there


def bins(effects: Sequence[Given]) -> list[Bin]:
    """By `EDGES`, those with any effect."""
    result = []
    for low, high in itertools.pairwise(EDGES):
        own = [one for one in effects if low <= one.probability and (one.probability < high or high == EDGES[-1])]
        if own:
            there = sum(one.there for one in own)
            mean = float(np.mean([one.probability for one in own]))
            result.append(Bin(low, high, len(own), there, mean, interval(there, len(own))))
    return result


def interval(there: int, count: int) -> tuple[float, float]:
    """Of a share, Clopper and Pearson's."""
    out = (1.0 - LEVEL) / 2.0
    low = float(stats.beta.ppf(out, there, count - there + 1)) if there else 0.0
    high = float(stats.beta.ppf(1.0 - out, there + 1, count - there)) if there < count else 1.0
    return low, high


def text(effects: Sequence[Given]) -> str:
    """The bins as a table, and what was given much and is not there, Markdown."""
    lines = ["| probability given | effects | mean | there | 95 % interval |", "|---|---|---|---|---|"]
    for one in bins(effects):
        low, high = one.interval
        lines.append(
            f"| {one.low:g} to {one.high:g} | {one.count} | {one.mean:.3f} | {one.there} ({one.there / one.count:.1%}) | {low:.1%} to {high:.1%} |"
        )
    missed = [one for one in effects if math.isnan(one.probability)]
    lines += [
        "",
        f"In no set of effects that was worth a fit: {len(missed)} of {sum(one.there for one in effects)} true effects.",
    ]
    wrong = [one for one in effects if one.probability > 0.5 and not one.there]
    if wrong:
        lines += ["", "Given more than a half, and not there:", ""]
        lines += [f"- {one.case}: `{one.effect}` {one.probability:.3f}" for one in wrong]
    return "\n".join(lines)


def picture(effects: Sequence[Given], path: Path) -> None:
    """Share that is there against the probability given, with intervals."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    found = bins(effects)
    figure, axis = plt.subplots(figsize=(5.2, 4.6))
    axis.plot([0.0, 1.0], [0.0, 1.0], color="0.6", lw=1.0, label="as often as given")
    shares = np.asarray([one.there / one.count for one in found])
    low, high = np.asarray([one.interval for one in found]).T
    means = [one.mean for one in found]
    axis.errorbar(means, shares, (shares - low, high - shares), fmt="o", capsize=3, label="measured, 95 % intervals")
    for one, share in zip(found, shares, strict=True):
        axis.annotate(str(one.count), (one.mean, share), textcoords="offset points", xytext=(7, -3), fontsize=8)
    axis.set_xlabel("probability that was given to an effect (number of effects)")
    axis.set_ylabel("share of these that are there")
    axis.legend(loc="upper left", fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=130)
    plt.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--to", type=Path, help="where reliability.md and reliability.png go; else the first folder")
    asked = parser.parse_args()
    effects = read(asked.folders)
    if not effects:
        parser.error(
            f"{asked.folders[0]} and the others hold no judged case; `python -m studies.attribution_benchmark.run` writes them"
        )
    to = asked.to or asked.folders[0]
    to.mkdir(parents=True, exist_ok=True)
    found = text(effects)
    replace(to / "reliability.md", found + "\n")
    picture(effects, to / "reliability.png")
    print(found)


if __name__ == "__main__":
    main()
