"""`smajax effects` and `smajax presets`: what there is."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Sequence
from typing import Annotated, Any

import typer

from smajax.cli import completion
from smajax.cli.options import Json, until_nobody_reads
from smajax.core.wording import aligned


def effects(
    names: Annotated[
        list[str] | None,
        typer.Argument(help="effects, or equations whose effects to list", autocompletion=completion.effects),
    ] = None,
    json_out: Json = False,
) -> None:
    """List the effects that `close-loop` may add: equation, formula, and what each means for a wire.

    With names: these alone; the name of an equation (heat, kinetics, sensor, ...) stands for all of its effects.

    Example:  smajax effects --json

    Example:  smajax effects latent_heat sensor
    """
    from smajax.core.names import instead
    from smajax.core.parameters import parameters
    from smajax.model.effects.library import LIBRARY

    told = {
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
                f"no effect or equation `{name}`{instead(name, sorted(known), 'there are')}", param_hint="NAMES"
            )
    if json_out:
        typer.echo(json.dumps(told))
        return
    with until_nobody_reads():
        for name, one in told.items():
            typer.echo(f"{name}  [{one['equation']}]\n  {one['title']}: {one['formula']}\n  {one['meaning']}")
            for full, entry in one["parameters"].items():  # type: ignore[attr-defined]
                typer.echo(f"    {full}: {entry['bounds'][0]:g} to {entry['bounds'][1]:g} {entry['unit']}")


def _parts(names: Sequence[str]) -> dict[str, dict[str, dict[str, Any]]]:
    """Preset -> its parameters by name, each with value, unit, bounds and meaning. Raises typer.BadParameter.

    Of a wire, a load and a drive together also those of the whole, as `model`.
    """
    from smajax.core.names import instead
    from smajax.model.presets import DRIVES, LOADS, WIRES, build, made_load

    made: dict[str, Callable[[str], Any]] = {
        **dict.fromkeys(WIRES, lambda name: WIRES[name]()),
        **dict.fromkeys(LOADS, made_load),
        **dict.fromkeys(DRIVES, lambda name: DRIVES[name]()),
    }
    for name in names:
        if name not in made:
            raise typer.BadParameter(f"no preset `{name}`{instead(name, made, 'there are')}", param_hint="NAMES")
    found = {name: _told(made[name](name), ()) for name in names}
    if [next((kind for kind in (WIRES, LOADS, DRIVES) if name in kind), None) for name in names] == [
        WIRES,
        LOADS,
        DRIVES,
    ]:
        whole = build(*names)
        found["model"] = _told(whole, {one for part in found.values() for one in part})
    return found


def _told(part: Any, without: Collection[str]) -> dict[str, dict[str, Any]]:
    from smajax.core.parameters import get_parameters, parameters

    return {
        one.name: {
            "value": float(get_parameters(part, [one.name])[0]),
            "unit": one.unit,
            "bounds": [one.low, one.high],
            "meaning": one.about,
        }
        for one in parameters(part).values()
        if one.name not in without
    }


def presets(
    names: Annotated[
        list[str] | None,
        typer.Argument(help="a wire, a load, a drive: list their parameters", autocompletion=completion.presets),
    ] = None,
    json_out: Json = False,
) -> None:
    """List the wires with their sizes, the loads and drives that an experiment file may name, and the controllers of the arm.

    With names: every parameter of these, with its value, unit, bounds and meaning.

    Example:  smajax presets

    Example:  smajax presets flexinol_table_3_2 dead_weight voltage
    """
    from smajax.core.runtime import prepare

    prepare()
    if names:
        parts = _parts(names)
        if json_out:
            typer.echo(json.dumps(parts))
            return
        with until_nobody_reads():
            for name, entries in parts.items():
                typer.echo(name if entries else f"{name}  (no parameters)")
                rows = [
                    [
                        f"  {one}",
                        f"{told['value']:.5g} {told['unit']}".removesuffix(" -"),
                        f"{told['bounds'][0]:g} to {told['bounds'][1]:g}",
                        told["meaning"],
                    ]
                    for one, told in entries.items()
                ]
                for line in aligned(rows) if rows else ():
                    typer.echo(line.rstrip())
        return
    from smajax.control.presets import CONTROLLERS
    from smajax.core.parameters import parameter_values, parameters
    from smajax.model.presets import DRIVES, LOADS, WIRES
    from smajax.model.wire.laws import LAWS

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
