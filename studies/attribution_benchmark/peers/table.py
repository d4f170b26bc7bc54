"""The loop beside its peers on the same cases, as tables."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from smajax.core.files import replace
from studies.attribution_benchmark.judge import Judged, called
from studies.attribution_benchmark.judge import load as load_judged
from studies.attribution_benchmark.peers.answer import judged, load
from studies.attribution_benchmark.tables import STRENGTHS, _table, share, strength_of

LOOP = "smajax"
# What each of them can say at all: effects by name, equations, that nothing is missing.
SAYS: dict[str, frozenset[str]] = {
    LOOP: frozenset(("effect", "equation", "verdict")),
    "greedy": frozenset(("effect", "equation", "verdict")),
    "pysindy": frozenset(("equation", "verdict")),
    "pysindy_sparse": frozenset(("equation", "verdict")),
    "jax_sysid": frozenset(),
    "plain": frozenset(),
}
CLOSE = 1.2  # noises: a held-out error that is as good as the benchmark asks for
BETTER = 0.95  # of the loop's held-out error: a peer that comes to less predicts better
Cases = Mapping[str, Judged]  # by the case's name
MISSING = "–"


def gathered(out: Path) -> dict[str, dict[str, Judged]]:
    """Method -> case -> what it said beside the truth, of all cases that the loop was scored on and the peer answered."""
    found: dict[str, dict[str, Judged]] = {LOOP: {}}
    for path in sorted((out / "judged").glob("*.json")):
        found[LOOP][path.stem] = load_judged(path)
    for peer in SAYS:
        for path in sorted((out / "peers" / peer).glob("*.json")):
            if path.stem in found[LOOP]:
                truth = json.loads((out / "cases" / "truth" / path.name).read_text(encoding="utf-8"))
                base = load(out / "peers" / "plain" / path.name)
                found.setdefault(peer, {})[path.stem] = judged(truth, load(path), base)
    return found


def common(methods: Mapping[str, Cases], names: Sequence[str]) -> list[str]:
    """Cases that all of `names` have answered."""
    return sorted(set.intersection(*(set(methods[name]) for name in names)))


def effect_added(one: Judged) -> bool:
    """Every true effect has been added itself: what could be mistaken for one does not count."""
    return all(set(called(name)) & set(one.added) for name in one.truth)


def needless(one: Judged) -> int:
    """Effects added that are none of the true ones."""
    true = {alias for name in one.truth for alias in called(name)}
    return len(set(one.added) - true)


def _median(values: Sequence[float]) -> str:
    return f"{np.median(values):.2f}" if len(values) else MISSING


def line(method: str, cases: Sequence[Judged]) -> list[str]:
    """One row of the table: `HEAD`."""
    says = SAYS[method]
    strong = [one for one in cases if one.kind == "single" and strength_of(one) == 10.0]
    pairs = [one for one in cases if one.kind == "pair"]
    outside = [one for one in cases if one.kind == "outside" and strength_of(one) == 10.0]
    empty = [one for one in cases if one.kind in ("null", "absorbed")]

    def where(what: str, some: Sequence[Judged], holds: Callable[[Judged], bool]) -> str:
        return share(some, holds) if what in says else MISSING

    extra = f"{np.mean([needless(one) for one in cases]):.1f}" if "effect" in says and cases else MISSING
    return [
        method,
        where("effect", strong, effect_added),
        where("effect", strong, lambda one: one.effect_right),
        where("equation", strong, lambda one: one.equation_right),
        where("effect", pairs, lambda one: one.effect_right),
        where("equation", outside, lambda one: one.equation_right),
        where("verdict", empty, lambda one: one.verdict != "adequate"),
        extra,
        _median([one.held_out_after for one in strong]),
        share(strong, lambda one: one.held_out_after <= CLOSE),
        _median([one.held_out_after for one in empty]),
        f"{np.median([one.seconds for one in cases]):.0f}" if cases else MISSING,
    ]


HEAD = (
    "",
    "right effect added",
    "or named beside it",
    "right equation first",
    "pairs: both effects",
    "outside: right equation",
    "false alarms",
    "needless effects a case",
    "held-out error, median",
    f"at most {CLOSE}",
    "held-out error where nothing is missing",
    "seconds, median",
)


def weaker(methods: Mapping[str, Cases], names: Sequence[str], cases: Sequence[str]) -> list[list[str]]:
    """(strength, method, cases, right effect added, right equation) of the strengths below the largest."""
    rows = []
    for size in STRENGTHS[:-1]:
        for name in names:
            own = [methods[name][case] for case in cases]
            own = [one for one in own if one.kind == "single" and strength_of(one) == size]
            if own and "equation" in SAYS[name]:
                effect = share(own, effect_added) if "effect" in SAYS[name] else MISSING
                rows.append([f"{size:g}", name, effect, share(own, lambda one: one.equation_right)])
    return rows


def _named(method: str, one: Judged) -> str:
    error = f"{one.held_out_after:.2f}"
    named = one.added if "effect" in SAYS[method] else one.where
    if not named:
        named = ("nothing",) if one.verdict == "adequate" else ("?",) if "verdict" in SAYS[method] else ()
    return f"{' + '.join(named)} {error}".strip()


def text(methods: Mapping[str, Cases]) -> str:
    """All tables, Markdown."""
    parts: list[str] = []
    there = [name for name in SAYS if methods.get(name)]
    quick = [name for name in there if name != "jax_sysid"]
    before: list[str] = []
    for names in (quick, there):
        cases = common(methods, names)
        if not cases or names == before:
            continue
        parts.append(f"{', '.join(names)} on {_counted([methods[LOOP][case] for case in cases])}:")
        parts.append(_table(HEAD, [line(name, [methods[name][case] for case in cases]) for name in names]))
        before = names
    cases = common(methods, quick)
    rows = weaker(methods, quick, cases)
    if rows:
        parts.append("Weaker effects:")
        parts.append(_table(("strength", "", "right effect added", "right equation first"), rows))
    parts.append(beaten(methods, [name for name in quick if name != LOOP], cases))
    listed = []
    for case in sorted(set(methods[LOOP])):
        one = methods[LOOP][case]
        if one.kind != "null" and any(case in methods[name] for name in there if name != LOOP):
            row = [_named(name, methods[name][case]) if case in methods[name] else "" for name in there]
            listed.append([case, f"{one.strength:.1f}", *row])
    if listed:
        parts.append("What each named, and its held-out error over the noise; nulls left out:")
        parts.append(_table(("case", "strength", *there), listed))
    return "\n\n".join(part for part in parts if part)


def _counted(cases: Sequence[Judged]) -> str:
    kinds = [one.kind for one in cases]
    rigs = ", ".join(sorted({one.rig for one in cases}))
    told = ", ".join(f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(sorted(kinds)))
    return f"{len(cases)} cases ({told}; {rigs})"


def beaten(methods: Mapping[str, Cases], peers: Sequence[str], cases: Sequence[str]) -> str:
    """Where a peer predicts held-out runs better than the loop."""
    told = []
    for name in peers:
        own = [
            case for case in cases if methods[name][case].held_out_after < BETTER * methods[LOOP][case].held_out_after
        ]
        told.append(f"{name} on {len(own)}" + (f" ({', '.join(own)})" if own else ""))
    return f"Held-out error more than 5 % below the loop's, of {len(cases)} cases: {'; '.join(told)}." if told else ""


def written(out: Path) -> str:
    """The tables as results_peers.md in `out`; the tables."""
    found = text(gathered(out))
    replace(out / "results_peers.md", found + "\n")
    return found
