"""Write the reference's pages of public names and of effects from the package itself: `python -m studies.make_reference`."""

from __future__ import annotations

import html
import inspect
import re
from pathlib import Path
from typing import Any

import smajax
from smajax.core.parameters import parameters
from smajax.model.effects.candidate import EQUATIONS, PRIOR_ODDS
from smajax.model.effects.library import LIBRARY, of_others
from smajax.model.effects.prior_width import stated_width
from smajax.report.effect_priors import odds_in_words, width_in_words

FOLDER = Path(__file__).parents[1] / "docs" / "reference"
NAMES = "names.md"
MADE = "Made from the package by `python -m studies.make_reference`; do not edit."
# What a name is that has no docstring, or one that says too little by itself.
SAID = {
    "CONTROLLERS": "Presets of controllers by name.",
    "DRIVES": "Presets of drives by name.",
    "EFFECTS": "The library of effects by name.",
    "LOADS": "Presets of loads by name.",
    "WIRES": "Presets of wires by name.",
    "Scalar": "A number as an array of JAX without axes: the annotation of a parameter.",
    "effects": "The effects, each in a module of its own.",
    "load_experiment": "Read an experiment file and its runs, with all presets, effects and parameters.",
}
# (heading, names) of the public names.
STAGES = (
    (
        "A model",
        (
            "compose",
            "build",
            "under_law",
            "IntegratedForm",
            "extended",
            "System",
            "WIRES",
            "LOADS",
            "DRIVES",
            "EFFECTS",
            "presets",
        ),
    ),
    ("Its parameters", ("parameters", "parameter_values", "get_parameters", "set_parameters", "check_bounds", "units")),
    ("One run", ("simulate_dataset", "plot", "simulate_compiled", "simulate")),
    ("Many runs", ("run_batch", "grid", "zipped", "sampled", "good", "status_summary", "measure", "prepare")),
    (
        "A closed loop",
        (
            "Loop",
            "loop_around",
            "simulate_loop_dataset",
            "simulate_closed_loop",
            "merit",
            "CONTROLLERS",
            "control_presets",
            "reference",
        ),
    ),
    ("Its gains", ("TuneSettings", "tune_in_folder", "write_tuning")),
    (
        "Measured runs",
        ("load_experiment", "base_model", "identify", "write_identified", "close_loop", "narrate", "write_report"),
    ),
    ("A model that is kept", ("ActuatorModel", "load_model", "predict", "write_prediction")),
    (
        "Your own parts",
        ("AbstractEffect", "Candidate", "contracts", "AbstractMovingLoad", "parameter", "Scalar", "effects"),
    ),
)


def _cell(text: str) -> str:
    """Plain text as code in a table. A bar would end the cell, and is shown with its stroke where it is escaped."""
    shown = " ".join(text.split())
    return f"<code>{html.escape(shown).replace('|', '&#124;')}</code>" if "|" in shown else f"`{shown}`"


def _first_paragraph(of: Any) -> str:
    summary = " ".join((inspect.getdoc(of) or "").split("\n\n")[0].split())
    return summary.replace("|", "\\|")


def _page_of(module: str) -> str:
    """The page of the reference that shows a module; "" for that of the public names, which shows what no other does."""
    shows = re.compile(rf"^::: {re.escape(module)}$", re.MULTILINE)
    others = (page for page in sorted(FOLDER.glob("*.md")) if page.name != NAMES)
    return next((page.name for page in others if shows.search(page.read_text(encoding="utf-8"))), "")


def _stages() -> list[tuple[str, tuple[str, ...]]]:
    """`STAGES`, and last the names that are in none of them."""
    summary = {name for _, members in STAGES for name in members}
    left = tuple(name for name in sorted([*smajax.NAMES, *smajax.MODULES]) if name not in summary)
    return [*STAGES, *([("More", left)] if left else [])]


def _row(name: str) -> str:
    if name in smajax.MODULES:
        module = smajax.MODULES[name]
        page = "effects.md" if name == "effects" else f"{_page_of(module)}#{module}"
        return f"| [`{name}`]({page}) | module | {SAID.get(name) or _first_paragraph(getattr(smajax, name))} |"
    module, own = smajax.NAMES[name]
    result = getattr(smajax, name)
    kind = "class" if inspect.isclass(result) else "function" if callable(result) else "table"
    about = SAID.get(name) or _first_paragraph(result)
    return f"| [`{name}`]({_page_of(module)}#{module}{'' if kind == 'table' else '.' + own}) | {kind} | {about} |"


def names() -> str:
    """The page of `import smajax as sma`."""
    lines = [
        "# Public names",
        "",
        MADE,
        "",
        "`import smajax as sma` has these names, as `sma.compose` and so on. Everything else is in modules, on the pages that these link.",
        "When a name here changes, the old one keeps working for a minor version, with a DeprecationWarning.",
        "",
        "Set the precision before the first array of JAX: `sma.prepare()` takes float64, and keeps compiled programs from one process to the next.",
    ]
    for heading, members in _stages():
        lines += ["", f"## {heading}", "", "| name | | |", "|---|---|---|", *(_row(name) for name in members)]
    modules = dict.fromkeys(
        smajax.NAMES[name][0] for _, members in _stages() for name in members if name in smajax.NAMES
    )
    for module in modules:
        if not _page_of(module):
            lines += ["", f"::: {module}"]
    return "\n".join(lines) + "\n"


def effects() -> str:
    """The page of the library: a table by equation, and the class of each."""
    own = {name: effect for name, effect in LIBRARY.items() if name not in of_others()}
    lines = [
        "# Effects",
        "",
        MADE,
        "",
        f"What the base model may lack: {len(own)} effects, one class each, in the contract of the equation that it changes. To add your own:",
        "[how to add an effect](../how-to/add-an-effect.md).",
    ]
    for equation in EQUATIONS:
        lines += [
            "",
            f"## {equation.capitalize()}",
            "",
            "| effect | what it is | what it changes | prior |",
            "|---|---|---|---|",
        ]
        for name, effect in own.items():
            if effect.candidate.equation == equation:
                group = effect.candidate.exclusive_group
                named = f"; at most one of the {group}" if group else ""
                lines.append(
                    f"| [`{name}`](#{effect.__module__}) | {effect.candidate.title} | {_cell(effect.candidate.formula)} | {odds_in_words(effect)}{named} |"
                )
    modules = dict.fromkeys(
        effect.__module__ for equation in EQUATIONS for effect in own.values() if effect.candidate.equation == equation
    )
    lines += ["", "What is known of each coefficient before the runs: [priors](priors.md).", "", "## Their classes"]
    first = [f"smajax.model.effects.{name}" for name in ("base", "candidate", "prior_width", "grouping", "library")]
    for module in (*first, "smajax.model.extended", *modules):
        lines += ["", f"::: {module}"]
    return "\n".join(lines) + "\n"


def priors() -> str:
    """The page of the prior of every coefficient."""
    own = {name: effect for name, effect in LIBRARY.items() if name not in of_others()}
    lines = [
        "# Priors of the effects",
        "",
        MADE,
        "",
        "What is known of a coefficient before the runs, where the wire or the bench has the effect: its base value and the standard",
        "deviation about it, in its own unit or of what the runs show (`Width` of [candidate](effects.md#smajax.model.effects.candidate)). The odds",
        "are those that the runs of an experiment need the effect:",
        f"{', '.join(f'{odds:g} for the class {name}' for name, odds in PRIOR_ODDS.items())}.",
        "",
        "| coefficient | prior | source; without a name it is an estimate of usual sizes |",
        "|---|---|---|",
    ]
    for effect in own.values():
        for name, entry in parameters(effect.base()).items():
            width = stated_width(effect, name.split(".", 1)[1])
            lines.append(f"| `{name}` | {width_in_words(entry.unit, width)} | {width.source} |")
    return "\n".join(lines) + "\n"


PAGES = {"effects.md": effects, "priors.md": priors, NAMES: names}


if __name__ == "__main__":
    for page, make in PAGES.items():
        (FOLDER / page).write_text(make(), encoding="utf-8")
