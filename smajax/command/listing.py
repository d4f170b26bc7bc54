"""`smajax effects` and `smajax presets`: what there is."""

from __future__ import annotations

import json
from typing import Any

import typer

from smajax.command.base import Json, until_nobody_reads


def effects(json_out: Json = False) -> None:
    """List the effects that `close-loop` may add: equation, formula, and what each means for a wire.

    Example:  smajax effects --json
    """
    from smajax.effects.library import LIBRARY
    from smajax.parameters import parameters

    told = {
        name: {
            "title": effect.title,
            "equation": effect.equation,
            "formula": effect.formula,
            "meaning": effect.sentence,
            "parameters": {
                entry.name: {"unit": entry.unit, "bounds": [entry.low, entry.high]}
                for entry in parameters(effect.base()).values()
            },
        }
        for name, effect in LIBRARY.items()
    }
    if json_out:
        typer.echo(json.dumps(told))
        return
    with until_nobody_reads():
        for name, one in told.items():
            typer.echo(f"{name}  [{one['equation']}]\n  {one['title']}: {one['formula']}\n  {one['meaning']}")
            for full, entry in one["parameters"].items():  # type: ignore[attr-defined]
                typer.echo(f"    {full}: {entry['bounds'][0]:g} to {entry['bounds'][1]:g} {entry['unit']}")


def presets(json_out: Json = False) -> None:
    """List the wires with their sizes, the loads and drives that an experiment file may name, and the controllers of the arm.

    Example:  smajax presets
    """
    from smajax.runtime import prepare

    prepare()
    from smajax.control_presets import CONTROLLERS
    from smajax.parameters import parameter_values, parameters
    from smajax.presets import DRIVES, LOADS, WIRES
    from smajax.wire.laws import LAWS

    sizes: dict[str, dict[str, dict[str, Any]]] = {}
    for name, make in WIRES.items():
        wire = make()
        units, values = parameters(wire), parameter_values(wire)
        sizes[name] = {one: {"value": values[one], "unit": units[one].unit} for one in ("wire_diameter", "wire_length")}
    told = {
        "wires": list(WIRES),
        "loads": list(LOADS),
        "drives": list(DRIVES),
        "controllers": list(CONTROLLERS),
        "laws": list(LAWS),
    }
    if json_out:
        typer.echo(json.dumps({**told, "wire_sizes": sizes}))
        return
    for kind, names in told.items():
        typer.echo(f"{kind}: {', '.join(names)}")
        if kind == "wires":
            for name, size in sizes.items():
                diameter, length = (size[one]["value"] for one in ("wire_diameter", "wire_length"))
                typer.echo(f"  {name}: diameter {1e3 * diameter:.4g} mm, length {1e3 * length:.4g} mm")
        if kind == "drives":  # several are a voltage
            for name, drive in DRIVES.items():
                typer.echo(f"  {name}: {(drive.__doc__ or '').splitlines()[0]}")
