"""The scored cases as tables and one picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from smajax.core.files import replace
from studies.attribution_benchmark.judge import EQUATIONS, NOTHING, OUTSIDE, REACHED, Judged, called, remaining
from studies.attribution_benchmark.reliability import interval

STRENGTHS = (1.0, 3.0, 10.0)


def share(cases: Sequence[Judged], holds: Callable[[Judged], bool]) -> str:
    """ "12 of 14 (86 %)"."""
    if not cases:
        return "none tried"
    good = sum(holds(one) for one in cases)
    return f"{good} of {len(cases)} ({100.0 * good / len(cases):.0f} %)"


def strength_of(one: Judged) -> float:
    """The largest of `STRENGTHS` that the case comes to, once the base model is refitted.

    The generator's refit bounds it from above: where the loop's own refit of the base model leaves less, that is what
    there was to see.
    """
    if one.several or not np.isfinite(one.fit_before):
        reached = one.strength
    else:
        reached = min(one.strength, remaining(one.fit_before))
    return _of_size(reached)


def _of_size(reached: float) -> float:
    return max([size for size in STRENGTHS if reached >= REACHED * size], default=0.0)


def _predicted(one: Judged) -> bool:
    return one.held_out_after <= 1.2


def _bars_of_drawn(drawn: Sequence[Judged]) -> list[tuple[str, str, str]]:
    """Of coefficients that were drawn."""
    strong = [one for one in drawn if one.strength >= STRENGTHS[1]]
    return [
        (
            "of drawn coefficients: held-out error at most 1.2 times the noise (in the library)",
            "90 %",
            share(drawn, _predicted),
        ),
        (
            "of drawn coefficients that leave three noises or more: every effect, or named beside it",
            "–",
            share(strong, lambda one: one.effect_right),
        ),
    ]


def bars(cases: Sequence[Judged]) -> list[tuple[str, str, str]]:
    """(what, bar, measured)."""
    nulls = [one for one in cases if one.kind == "null"]
    strong = [one for one in cases if one.kind == "single" and strength_of(one) == 10.0]
    pairs = [one for one in cases if one.kind == "pair" and one.full]
    triples = [one for one in cases if one.kind == "triple" and one.full]
    short = [one for one in cases if one.several and one.short]
    lowered = [one for one in cases if one.kind == "single" and strength_of(one) < _of_size(one.strength)]
    middle = [one for one in cases if one.kind == "single" and strength_of(one) == 3.0]
    outside = [one for one in cases if one.kind == "outside" and strength_of(one) >= 3.0]
    asked = [one for one in cases if one.kind == "single" and one.asked == 10.0 and one.strength >= REACHED * 10.0]
    return [
        (
            f"nothing is missing, and it says so (false alarms: at most {most_alarms(nulls):.1%} at 95 %)",
            "100 %",
            share(nulls, lambda one: one.verdict == "adequate"),
        ),
        (
            "what other values of the unknowns imitate: nothing is missing",
            "–",
            share([one for one in cases if one.kind == "absorbed"], lambda one: one.right),
        ),
        ("10 times the noise: right equation", "98 %", share(strong, lambda one: one.equation_right)),
        ("10 times the noise: right effect, or named beside it", "95 %", share(strong, lambda one: one.effect_right)),
        ("3 times the noise: right equation", "95 %", share(middle, lambda one: one.equation_right)),
        ("3 times the noise: right effect, or named beside it", "90 %", share(middle, lambda one: one.effect_right)),
        (
            "the same of all that were written with 10 noises: equation",
            "–",
            share(asked, lambda one: one.equation_right),
        ),
        ("the same of all that were written with 10 noises: effect", "–", share(asked, lambda one: one.effect_right)),
        ("of all effects that were added to singles, pairs and triples, those that are there", "–", precision(cases)),
        (
            "single effects that are counted lower, because the loop's own refit of the base model leaves less",
            "–",
            f"{len(lowered)} of {sum(one.kind == 'single' for one in cases)}",
        ),
        ("both effects of a pair", "85 %", share(pairs, lambda one: one.effect_right)),
        ("all three effects of a triple", "–", share(triples, lambda one: one.effect_right)),
        (
            "all effects of a pair or triple of which one has less than the strength asked for",
            "–",
            share(short, lambda one: one.effect_right),
        ),
        (
            "held-out error of a triple at most 1.5 times the noise",
            "–",
            share(triples, lambda one: one.held_out_after <= 1.5),
        ),
        (
            "outside the library, 3 times or more: said so, or the right equation",
            "90 %",
            share(outside, lambda one: one.right),
        ),
        (
            "held-out error at most 1.2 times the noise (in the library, 10 times)",
            "all",
            share(strong, _predicted),
        ),
        (
            "held-out error at most 1.2 times the noise (in the library, 3 times or more)",
            "90 %",
            share([*strong, *middle], _predicted),
        ),
        *_bars_of_drawn([one for one in cases if np.isnan(one.asked) and one.kind != "outside"]),
        ("a case in under two minutes", "all", share(cases, lambda one: one.seconds < 120.0)),
        ("a case in under three minutes", "all", share(cases, lambda one: one.seconds < 180.0)),
        (
            "seconds of a case, median",
            "30",
            f"{np.median([one.seconds for one in cases]):.0f}" if cases else "none tried",
        ),
    ]


def most_alarms(nulls: Sequence[Judged]) -> float:
    """Upper end of the 95 % interval of the rate of false alarms (Clopper and Pearson 1934)."""
    alarms = sum(one.verdict != "adequate" for one in nulls)
    return interval(alarms, len(nulls))[1]


def precision(cases: Sequence[Judged]) -> str:
    """Of what was added, how much is true: "31 of 36 (86 %)"."""
    added = [(one, name) for one in cases if one.kind == "single" or one.several for name in one.added]
    true = [name for one, name in added if any(name in called(effect) for effect in one.truth)]
    return f"{len(true)} of {len(added)} ({100.0 * len(true) / len(added):.0f} %)" if added else "nothing added"


def confusion(cases: Sequence[Judged]) -> tuple[list[str], list[str], np.ndarray]:
    """(true, named, counts) by equation, cases with one effect or none."""
    rows = [*EQUATIONS, NOTHING]
    columns = [*EQUATIONS, OUTSIDE, NOTHING]
    counts = np.zeros((len(rows), len(columns)), int)
    for one in cases:
        if one.several:
            continue
        counts[rows.index(one.equations[0] if one.equations else NOTHING), columns.index(one.told)] += 1
    return rows, columns, counts


def power(cases: Sequence[Judged]) -> list[tuple[str, str, str, str, str]]:
    """(strength, cases, not called adequate, right equation, right effect) of single effects of the library."""
    single = [one for one in cases if one.kind == "single"]
    by_size = [(size, [one for one in _usual(single) if strength_of(one) == size]) for size in STRENGTHS]
    # What was asked for beside these is weaker than any of them, or counts by what was asked for.
    asked = sorted({one.asked for one in single} - {one.asked for one in _usual(single)})
    found = []
    for size, own in [*((size, [one for one in single if one.asked == size]) for size in asked), *by_size]:
        found.append(
            (
                f"{size:g}",
                str(len(own)),
                share(own, lambda one: one.verdict != "adequate"),
                share(own, lambda one: one.equation_right),
                share(own, lambda one: one.effect_right),
            )
        )
    return found


def _usual(cases: Sequence[Judged]) -> list[Judged]:
    """Those at the strengths of which the bars speak."""
    return [one for one in cases if one.asked in (0.0, *STRENGTHS)]


def missed(cases: Sequence[Judged]) -> list[Judged]:
    """Cases behind a bar that was missed: nulls with an alarm, effects of three noises or more that were not named, or not held to be outside."""
    return [one for one in cases if not one.right and _counts(one)]


def _counts(one: Judged) -> bool:
    return one.kind == "null" or (one.full if one.several else one.kind != "absorbed" and strength_of(one) >= 3.0)


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [f"| {' | '.join(head)} |", f"|{'---|' * len(head)}"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)])


def text(cases: Sequence[Judged]) -> str:
    """All tables, Markdown. Single effects at further strengths are in the table of power alone."""
    every, cases = cases, _usual(cases)
    rows, columns, counts = confusion(cases)
    matrix = [[name, *(str(count or "") for count in line)] for name, line in zip(rows, counts, strict=True)]
    listed = [
        [
            one.case,
            f"{one.strength:.1f}",
            "–" if one.several else f"{strength_of(one):g}",
            one.verdict,
            " + ".join(one.added) or "–",
            f"{one.held_out_after:.2f}",
        ]
        for one in missed(cases)
    ]
    before = np.asarray([one.held_out_before for one in cases if one.kind == "single"])
    after = np.asarray([one.held_out_after for one in cases if one.kind == "single"])
    held = (
        f"Held-out error of single effects over the noise, median: {np.median(before):.2f} with the base model refitted, "
        f"{np.median(after):.2f} after."
        if len(before)
        else ""
    )
    return "\n\n".join(
        [
            f"{len(every)} cases.",
            _table(("bar", "asked", "measured"), bars(cases)),
            "Equation named (columns) for the equation that lacks something (rows); single effects, foreign ones and nulls:",
            _table(("", *columns), matrix),
            "Power by strength, in noises left after a refit of the base model:",
            _table(("strength", "cases", "seen", "right equation", "right effect or named beside it"), power(every)),
            held,
            "Cases behind the bars that were missed:" if listed else "",
            _table(("case", "strength", "counted as", "verdict", "added", "held-out error / noise"), listed)
            if listed
            else "",
        ]
    )


def picture(cases: Sequence[Judged], path: Path) -> None:
    """Confusion matrix and power."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    rows, columns, counts = confusion(cases)
    figure, (left, right) = plt.subplots(1, 2, figsize=(12.0, 4.8), width_ratios=(1.4, 1.0))
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    left.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for (row, column), count in np.ndenumerate(counts):
        if count:
            left.text(
                column, row, str(count), ha="center", va="center", color="w" if shares[row, column] > 0.5 else "k"
            )
    left.set_xticks(range(len(columns)), columns, rotation=35, ha="right")
    left.set_yticks(range(len(rows)), rows)
    left.set_xlabel("named")
    left.set_ylabel("lacks something")
    for what, label in (
        (lambda one: one.verdict != "adequate", "seen"),
        (lambda one: one.equation_right, "right equation"),
        (lambda one: one.effect_right, "right effect, or named beside it"),
    ):
        points = []
        for size in STRENGTHS:
            own = [one for one in cases if one.kind == "single" and strength_of(one) == size]
            points.append(np.mean([what(one) for one in own]) if own else np.nan)
        right.plot(STRENGTHS, points, "o-", label=label)
    nulls = [one.verdict != "adequate" for one in cases if one.kind == "null"]
    if nulls:
        right.axhline(np.mean(nulls), color="0.5", ls="--", label=f"false alarms on {len(nulls)} nulls")
    right.set_xscale("log")
    right.set_xlim(0.8 * min(STRENGTHS), 1.25 * max(STRENGTHS))  # where there are only nulls no point says it
    right.set_xticks(STRENGTHS, [f"{size:g}" for size in STRENGTHS])
    right.set_ylim(-0.02, 1.02)
    right.set_xlabel("strength: noises left after a refit of the base model")
    right.set_ylabel("share of cases")
    right.legend(loc="lower right", fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=130)
    plt.close(figure)


def written(cases: Sequence[Judged], out: Path) -> str:
    """Tables as results.md and the picture as results.png in `out`; the tables."""
    found = text(cases)
    replace(out / "results.md", found + "\n")
    picture(_usual(cases), out / "results.png")
    return found
