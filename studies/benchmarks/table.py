"""What was measured, as a page: each bar with the number beside it, missed ones as well."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

Found = Mapping[str, Mapping[str, Any]]
LOADS = {
    "text": "text, MB of a log, three of whose ten columns are read",
    "samples": "samples, of one run through identify (from 2,000,000 on several to a step)",
    "day": "day, hours of an arm at 5 ms, kept every second",
    "runs": "runs, of 300 samples in one experiment through close-loop",
}


def _each(result: Found, name: str, *way: str) -> float | None:
    """Milliseconds a trajectory of a part, or None where it could not run."""
    at: Any = result.get(name, {})
    for key in (*way, "ms_per_trajectory"):
        at = at.get(key) if isinstance(at, Mapping) else None
    return float(at) if at is not None else None


def _ratio(other: float | None, own: float | None) -> float | None:
    return other / own if other and own else None


def _row(what: str, bar: str, value: float | None, holds: bool | None, form: str = "{:.2f}") -> str:
    shown = "not measured" if value is None else form.format(value)
    return f"| {what} | {bar} | {shown} | {'' if value is None or holds is None else 'yes' if holds else '**no**'} |"


def _at_least(what: str, least: float, value: float | None) -> str:
    return _row(what, f">= {least:g}", value, value is not None and value >= least)


def _at_most(what: str, most: float, value: float | None, unit: str = "") -> str:
    return _row(what, f"<= {most:g}{unit}", value, value is not None and value <= most)


def _ratios(result: Found) -> list[str]:
    fixed, own, single = _each(result, "smajax"), _each(result, "smajax_own_steps"), result.get("single", {})
    scipy = _each(result, "scipy", "best")
    gradient = result.get("gradient", {})
    rows = [
        _at_least(
            "throughput over the C++ program, the same fixed steps, float64",
            0.7,
            _ratio(_each(result, "cpp", "double"), fixed),
        ),
        _at_least(
            "throughput over the C++ program, the same fixed steps, float32",
            0.7,
            _ratio(_each(result, "cpp", "float"), _each(result, "smajax_float32")),
        ),
        _at_least(
            "throughput over the C++ program, own steps, float64", 0.7, _ratio(_each(result, "cpp", "double"), own)
        ),
        _at_least(
            "throughput over the C++ program, own steps, float32",
            0.7,
            _ratio(_each(result, "cpp", "float"), _each(result, "smajax_own_steps_float32")),
        ),
        _row(
            "throughput over numba, the same scheme and fixed steps, float64",
            "",
            _ratio(_each(result, "numba", "double"), fixed),
            None,
        ),
        _row("throughput over numba, own steps, float64", "", _ratio(_each(result, "numba", "double"), own), None),
        _at_least("throughput over diffrax at its best", 5.0, _ratio(_each(result, "diffrax", "best"), own)),
        _at_least("throughput over scipy's LSODA", 200.0, _ratio(scipy, own)),
        _at_least("one trajectory: scipy's time over ours", 1.0, _ratio(scipy, single.get("ms"))),
        _at_most("first call of a process, nothing kept, s", 3.0, single.get("first_call_s")),
        _at_most("reverse-mode gradient by all parameters over one run", 4.0, gradient.get("gradient_over_cost")),
        _at_most("the same by XLA", 4.0, gradient.get("xla", {}).get("gradient_over_cost")),
    ]
    tracked = result.get("gradient_tracking", {})
    others = [
        1e3 * float(one["gradient_s"]) / part["members"]
        for part in (result.get("gradient_diffrax", {}), result.get("gradient_gradsolve", {}))
        for one in part.get("ways", [])
        if "gradient_s" in one
    ]
    if tracked or others:
        each = 1e3 * float(tracked["gradient_s"]) / tracked["members"] if "gradient_s" in tracked else None
        rows.append(
            _row(
                "one gradient by all parameters: the fastest other's time over ours",
                "",
                _ratio(min(others, default=None), each),
                None,
            )
        )
    if "jacobian_over_cost" in gradient.get("xla", {}):
        most = 1.0 + float(gradient["parameters"])
        what = f"forward Jacobian by {most - 1:.0f} parameters over one run, XLA's"
        rows.append(_at_most(what, most, gradient["xla"]["jacobian_over_cost"]))
    return ["| | bar | measured | holds |", "|---|---|---|---|", *rows]


def _times(result: Found) -> list[str]:
    rows = [
        "| | ms a trajectory | error of the angle, degrees | of the fraction | compiling, s | peak memory, MB |",
        "|---|---|---|---|---|---|",
    ]
    parts = {
        "smajax, own steps, float64": result.get("smajax_own_steps", {}),
        "smajax, own steps, float32": result.get("smajax_own_steps_float32", {}),
        "smajax, fixed steps, float64": result.get("smajax", {}),
        "smajax, fixed steps, float32": result.get("smajax_float32", {}),
        "diffrax": result.get("diffrax", {}).get("best", result.get("diffrax", {})),
        "scipy LSODA, one core": result.get("scipy", {}).get("best", result.get("scipy", {})),
        "C++, float64": result.get("cpp", {}).get("double", result.get("cpp", {})),
        "C++, float32": result.get("cpp", {}).get("float", result.get("cpp", {})),
        "numba, float64": result.get("numba", {}).get("double", result.get("numba", {})),
        "numba, float32": result.get("numba", {}).get("float", result.get("numba", {})),
    }
    keys = ("ms_per_trajectory", "angle_error", "fraction_error", "compile_s", "peak_memory_MB")
    for name, one in parts.items():
        if one.get("ms_per_trajectory") is None:
            rows.append(f"| {name} | {one.get('reason', 'not measured')} | | | | |")
        else:
            # What is not accurate enough is shown for what it is.
            named = name if one.get("accurate", True) else f"{name}, **not accurate enough**"
            rows.append(f"| {named} | " + " | ".join(f"{one[key]:.3g}" if key in one else "" for key in keys) + " |")
    best = result.get("diffrax", {}).get("best")
    if best:
        way = "adaptive" if best["adaptive"] else "fixed steps"
        rows += ["", f"diffrax's best: {best['solver']}, {way}, {best['setting']:g}, blocks of {best['block']}."]
    return rows


def _section(title: str, head: str, rows: Sequence[str], words: str = "") -> list[str]:
    """A table under a title, a word or two before it; nothing without rows."""
    if not rows:
        return []
    under = "|" + "---|" * head.count(" | ") + "---|"
    return [f"## {title}", "", *([words, ""] if words else []), f"| {head} |", under, *rows, ""]


def _gradients(result: Found) -> list[str]:
    """Ours, and every way of the others, found or not."""
    own = result.get("gradient_tracking", {})
    rows, steps = [], []

    def row(name: str, setting: str, one: Mapping[str, Any], runs: int, way: str = "gradient") -> str:
        if f"{way}_s" not in one:
            return f"| {name} | | {one.get('reason', 'not measured')} | | | | | |"
        cost, slopes = (1e3 * float(one[f"{key}_s"]) / runs for key in ("cost", way))
        numbers = (cost, slopes, one[f"{way}_over_cost"], one["gradient_error"], one[f"{way}_memory_MB"])
        shown = " | ".join(f"{number:.3g}" for number in numbers)
        return f"| {name} | {setting} | {shown} | {one[f'{way}_compile_s']:.1f} |"

    if not any(name in result for name in ("gradient_tracking", "gradient_diffrax", "gradient_gradsolve")):
        return []
    by_xla = {**own, **own.get("xla", {})} if "xla" in own else {"reason": own.get("reason", "not measured")}
    for name, one, way in (
        ("smajax, machine code", own, "gradient"),
        ("smajax, XLA", by_xla, "gradient"),
        ("smajax, XLA, forward mode", by_xla, "jacobian"),
    ):
        rows.append(row(name, f"steps of {1e3 * own.get('setting', 0.0):g} ms", one, own.get("members", 1), way))
    for peer in ("diffrax", "gradsolve"):
        part = result.get(f"gradient_{peer}", {})
        if "ways" not in part:
            rows.append(row(peer, "", part, 1))
        for one in part.get("ways", []):
            rows.append(row(one["way"], f"{one.get('setting', 0.0):g}", one, part["members"]))
            if "record_s" in one:
                steps.append(f"{1e3 * one['record_s'] / part['members']:.2g} ms ({one['engine']})")
    words = (
        "The mean square distance from a ramp by all parameters of the arm (`studies/benchmarks/tracking.py`), all members in "
        "one program on one core; each at its loosest tolerance whose gradient is off by less than 3 % of its norm, by central differences of a tight solution. "
        "Memory: of machine code what a thread works in, with 64 members side by side; of XLA what the program needs for all of them."
    )
    if steps:
        words += f" gradsolve's steps are found before, again when the parameters move: {', '.join(steps)} a run more."
    head = "way | tolerance | ms a run | ms a gradient | gradient over its run | error | memory, MB | compiling, s"
    return _section("A gradient by all parameters, beside others", head, rows, words)


def _growth(result: Found) -> list[str]:
    def runs(part: str, known: str) -> list[Mapping[str, Any]]:
        return [one for one in result.get(part, {}).get("runs", []) if known in one]

    def told_of(one: Mapping[str, Any]) -> str:
        return f"{one['cost_memory_MB']:.3g} | {one['gradient_memory_MB']:.3g} | {one['gradient_over_cost']:.2f}"

    return [
        *_section(
            "Memory of a gradient",
            "steps | a run, MB | its gradient, MB | gradient over run, time | XLA: a run, MB | its gradient, MB | gradient over run, time",
            [
                f"| {one['steps']:,} | {told_of(one)} | {told_of(one['xla'])} |"
                for one in runs("gradient_memory", "xla")
            ],
            "Machine code: of a thread, which runs 64 members side by side. XLA: of one member.",
        ),
        *_section(
            "Many members, streamed to a store",
            "members | s, compiling included | ms each | peak memory, MB | of it imports | store, MB",
            [
                f"| {one['members']:,} | {one['s']:.1f} | {one['ms_per_trajectory']:.3g} | {one['peak_memory_MB']:.0f} | {one['imports_MB']:.0f} | {one['store_MB']:.1f} |"
                for one in runs("scale", "members")
            ],
        ),
        *_section(
            "Loads",
            "what | N | s | peak memory, MB | of it grown by the work",
            [
                f"| {LOADS[one['what']]} | {one['count']:,} | {one['s']:.1f} | {one['peak_memory_MB']:.0f} | {one['grown_MB']:.0f} |"
                for one in runs("loads", "count")
            ],
            "`python -m studies.benchmarks.load WHAT --count N`, each in a process of its own.",
        ),
    ]


def told(machine: Mapping[str, Any], result: Found) -> str:
    """The page, Markdown."""
    versions = ", ".join(f"{name} {version}" for name, version in machine["versions"].items())
    lines = [
        "# Benchmarks",
        "",
        f"{machine['processor']}, {machine['cores']} cores, {machine['system']}, Python {machine['python']}, "
        f"{machine['compiler']}; {versions}.",
        "",
        "Rotary arm, 10 s, constant voltage; accurate to 0.05 degrees and 1e-3 of the fraction against a tight solution "
        "(`studies/benchmarks/problem.py`). Every ratio is of `python -m studies.benchmarks.run` on this machine; "
        "what was not run again keeps its number of an earlier run.",
        "",
        *_ratios(result),
        "",
        "## Times",
        "",
        *_times(result),
        "",
        *_gradients(result),
        *_growth(result),
    ]
    return "\n".join(lines)
