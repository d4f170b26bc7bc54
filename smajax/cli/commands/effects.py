"""`smajax effects`: the effects that `close-loop` may add."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Any

import typer

from smajax.cli import completion
from smajax.cli.options import Json
from smajax.cli.terminal import until_pipe_closes

if TYPE_CHECKING:
    from smajax.model.effects.base import AbstractEffect


def effects(
    names: Annotated[
        list[str] | None,
        typer.Argument(help="effects, or equations whose effects to list", autocompletion=completion.effects),
    ] = None,
    json_out: Json = False,
) -> None:
    """List the effects that `close-loop` may add: equation, formula, physical meaning, prior odds and widths.

    With names these alone; the name of an equation (heat, kinetics, sensor, ...) means all of its effects.

    Example:  smajax effects --json

    Example:  smajax effects latent_heat sensor
    """
    from smajax.core.names import close_matches
    from smajax.model.effects.library import LIBRARY

    known = {*LIBRARY, *(effect.candidate.equation for effect in LIBRARY.values())}
    for name in names or ():
        if name not in known:
            raise typer.BadParameter(
                f"no effect or equation `{name}`{close_matches(name, sorted(known), 'there are')}", param_hint="NAMES"
            )
    chosen = {
        name: effect
        for name, effect in LIBRARY.items()
        if not names or name in names or effect.candidate.equation in names
    }
    if json_out:
        typer.echo(json.dumps({name: _entry(effect) for name, effect in chosen.items()}))
        return
    with until_pipe_closes():
        for effect in chosen.values():
            typer.echo(_text(effect))


def _entry(effect: type[AbstractEffect]) -> dict[str, Any]:
    """One effect for a program. `sigma` is in `unit`, and of the natural logarithm where it is logarithmic."""
    from smajax.core.parameters import parameters
    from smajax.model.effects.candidate import PRIOR_ODDS
    from smajax.model.effects.prior_width import stated_width, unit_of_width

    candidate = effect.candidate
    entries: dict[str, dict[str, Any]] = {}
    for name, entry in parameters(effect.base()).items():
        width = stated_width(effect, name.split(".", 1)[1])
        entries[name] = {
            "unit": entry.unit,
            "bounds": [entry.low, entry.high],
            "prior": width._asdict() | {"unit": unit_of_width(entry.unit, width)},
        }
    return {
        "title": candidate.title,
        "equation": candidate.equation,
        "formula": candidate.formula,
        "meaning": candidate.sentence,
        "exclusive_group": candidate.exclusive_group,
        "similar_group": candidate.similar_group,
        "same_as": list(candidate.same_as),
        "prior": {"class": candidate.prior_class, "odds": PRIOR_ODDS[candidate.prior_class]},
        "parameters": entries,
    }


def _text(effect: type[AbstractEffect]) -> str:
    from smajax.core.parameters import parameters
    from smajax.model.effects.prior_width import stated_width
    from smajax.report.effect_priors import odds_in_words, width_in_words

    candidate = effect.candidate
    lines = [
        f"{effect.effect_name}  [{candidate.equation}; {odds_in_words(effect)}]",
        f"  {candidate.title}: {candidate.formula}",
        f"  {candidate.sentence}",
    ]
    if candidate.exclusive_group:
        lines.append(f"  At most one effect of this group is added: {candidate.exclusive_group}.")
    if candidate.similar_group:
        lines.append(
            f"  Effects of this group look much the same in a log, and each is tried in the place of another: {candidate.similar_group}."
        )
    if candidate.same_as:
        lines.append(f"  Not looked for where a fit has {' and '.join(candidate.same_as)} free, which says the same.")
    for name, entry in parameters(effect.base()).items():
        width = stated_width(effect, name.split(".", 1)[1])
        lines += [
            f"    {name}: {entry.low:g} to {entry.high:g} {entry.unit}",
            f"      prior {width_in_words(entry.unit, width)}; {width.source}",
        ]
    return "\n".join(lines)
