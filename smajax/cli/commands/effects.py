"""`smajax effects`: the effects that `close-loop` may add."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from smajax.cli import completion
from smajax.cli.options import Json
from smajax.cli.terminal import until_pipe_closes


def effects(
    names: Annotated[
        list[str] | None,
        typer.Argument(help="effects, or equations whose effects to list", autocompletion=completion.effects),
    ] = None,
    json_out: Json = False,
) -> None:
    """List the effects that `close-loop` may add: equation, formula and physical meaning.

    With names these alone; the name of an equation (heat, kinetics, sensor, ...) means all of its effects.

    Example:  smajax effects --json

    Example:  smajax effects latent_heat sensor
    """
    from smajax.core.names import close_matches
    from smajax.core.parameters import parameters
    from smajax.model.effects.library import LIBRARY

    entries = {
        name: {
            "title": effect.candidate.title,
            "equation": effect.candidate.equation,
            "formula": effect.candidate.formula,
            "meaning": effect.candidate.sentence,
            "parameters": {
                entry.name: {"unit": entry.unit, "bounds": [entry.low, entry.high]}
                for entry in parameters(effect.base()).values()
            },
        }
        for name, effect in LIBRARY.items()
        if not names or name in names or effect.candidate.equation in names
    }
    known = {*LIBRARY, *(effect.candidate.equation for effect in LIBRARY.values())}
    for name in names or ():
        if name not in known:
            raise typer.BadParameter(
                f"no effect or equation `{name}`{close_matches(name, sorted(known), 'there are')}", param_hint="NAMES"
            )
    if json_out:
        typer.echo(json.dumps(entries))
        return
    with until_pipe_closes():
        for name, one in entries.items():
            typer.echo(f"{name}  [{one['equation']}]\n  {one['title']}: {one['formula']}\n  {one['meaning']}")
            for full, entry in one["parameters"].items():  # type: ignore[attr-defined]
                typer.echo(f"    {full}: {entry['bounds'][0]:g} to {entry['bounds'][1]:g} {entry['unit']}")
