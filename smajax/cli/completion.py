"""What the Tab key offers for a value: names of what there is. Each imports its list when it is asked."""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Iterable
from pathlib import Path

import typer


def _offered(names: Iterable[str], begun: str) -> list[str]:
    return [name for name in names if name.startswith(begun)]


def wires(incomplete: str) -> list[str]:
    from smajax.model.presets import WIRES

    return _offered(WIRES, incomplete)


def loads(incomplete: str) -> list[str]:
    from smajax.model.presets import LOADS

    return _offered(LOADS, incomplete)


def drives(incomplete: str) -> list[str]:
    from smajax.model.presets import DRIVES

    return _offered(DRIVES, incomplete)


def presets(incomplete: str) -> list[str]:
    return [*wires(incomplete), *loads(incomplete), *drives(incomplete), *controllers(incomplete)]


def effects(incomplete: str) -> list[str]:
    from smajax.model.effects.library import LIBRARY

    equations = dict.fromkeys(effect.candidate.equation for effect in LIBRARY.values())
    return _offered([*equations, *LIBRARY], incomplete)


def laws(incomplete: str) -> list[str]:
    from smajax.model.wire.laws import LAWS

    return _offered(LAWS, incomplete)


def controllers(incomplete: str) -> list[str]:
    from smajax.control.presets import CONTROLLERS

    return _offered(CONTROLLERS, incomplete)


def _after_commas(names: Iterable[str], incomplete: str, end: str = "") -> list[str]:
    """After the last comma; none twice. `end` follows each name."""
    *done, begun = incomplete.split(",")
    there = {one.partition("=")[0] for one in done}
    return [",".join([*done, name + end]) for name in _offered(names, begun) if name not in there]


def several_controllers(incomplete: str) -> list[str]:
    return _after_commas(controllers(""), incomplete)


def mismatches(incomplete: str) -> list[str]:
    from smajax.control.mismatch import MISMATCHES

    return _after_commas(MISMATCHES, incomplete)


def shares_of_mismatches(incomplete: str) -> list[str]:
    from smajax.control.mismatch import MISMATCHES

    return _after_commas(MISMATCHES, incomplete, "=")


def terms(incomplete: str) -> list[str]:
    from smajax.control.tune.terms import TERMS

    return _after_commas(TERMS, incomplete, "=")


def objectives(incomplete: str) -> list[str]:
    from smajax.control.tune.objective import OBJECTIVES

    return _offered(OBJECTIVES, incomplete)


def rules(incomplete: str) -> list[str]:
    from smajax.control.tune.multistart import RULES

    return _offered(RULES, incomplete)


def _before(ctx: typer.Context) -> list[str]:
    """The words before, where an option that still lacks its value keeps them from being read."""
    return [str(word) for word in (*ctx.params.values(), *ctx.args) if isinstance(word, (str, Path))]


def values(ctx: typer.Context, incomplete: str) -> list[str]:
    """Parameters of the model that the words before name, short names first."""
    from smajax.control.mismatch import MISMATCHES
    from smajax.control.run_request import RunRequest
    from smajax.core.parameters import parameters
    from smajax.model.presets import DRIVES, LOADS, WIRES

    kinds = {"wire": WIRES, "load": LOADS, "drive": DRIVES}
    # The last one named: what is typed comes behind the defaults.
    named = {kind: word for kind, there in kinds.items() for word in _before(ctx) if word in there}
    model = dataclasses.replace(RunRequest(), **named).system()  # type: ignore[arg-type]
    there = parameters(model)
    short = [name for name, own in MISMATCHES.items() if own in there]
    return _after_commas(dict.fromkeys([*short, *there]), incomplete, "=")


def unknowns_declared(ctx: typer.Context, incomplete: str) -> list[str]:
    """What the experiment before is to find; nothing where it cannot be read: the command will say why."""
    for path in map(Path, _before(ctx)):
        try:
            experiment = tomllib.loads(
                (path / "experiment.toml" if path.is_dir() else path).read_text(encoding="utf-8")
            )
            return _after_commas([*experiment["unknown"], "all"], incomplete)
        except (KeyError, OSError, TypeError, ValueError):
            continue
    return []


def demos(incomplete: str) -> list[str]:
    from smajax.cli.options import DEMOS

    return _offered(DEMOS, incomplete)


def estimators(incomplete: str) -> list[str]:
    from smajax.control.presets import FILTERS

    return _offered(FILTERS, incomplete)


def figures(incomplete: str) -> list[str]:
    from smajax.cli.source_figures import load

    try:
        catalogue = load("catalogue")
    except FileNotFoundError:
        return []  # the command itself says what to do
    return _offered([*catalogue.CHAPTERS, *(row.name for row in catalogue.every_row())], incomplete)
