"""`smajax presets`: wires, loads, drives and controllers by name, and their parameters."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from smajax.cli import completion
from smajax.cli.options import Json
from smajax.cli.terminal import until_pipe_closes
from smajax.core.wording import aligned


def _parts(names: Sequence[str]) -> dict[str, dict[str, dict[str, Any]]]:
    """Preset -> its parameters by name, each with value, unit, bounds and meaning. Raises typer.BadParameter.

    Of a wire, a load and a drive together also those of the whole, as `model`. Of a controller the gains of the arm.
    """
    from smajax.control.presets import CONTROLLERS
    from smajax.core.names import close_matches
    from smajax.model.presets import DRIVES, LOADS, WIRES, build, made_load
    from smajax.model.rigs import arm

    made: dict[str, Callable[[str], Any]] = {
        **dict.fromkeys(WIRES, lambda name: WIRES[name]()),
        **dict.fromkeys(LOADS, made_load),
        **dict.fromkeys(DRIVES, lambda name: DRIVES[name]()),
        **dict.fromkeys(CONTROLLERS, lambda name: CONTROLLERS[name].make(arm())),
    }
    for name in names:
        if name not in made:
            raise typer.BadParameter(f"no preset `{name}`{close_matches(name, made, 'there are')}", param_hint="NAMES")
    known = {name: one.known for name, one in CONTROLLERS.items()}  # of the plant
    result = {name: _entries(made[name](name), known.get(name, ())) for name in names}
    if [next((kind for kind in (WIRES, LOADS, DRIVES) if name in kind), None) for name in names] == [
        WIRES,
        LOADS,
        DRIVES,
    ]:
        whole = build(*names)
        result["model"] = _entries(whole, {one for part in result.values() for one in part})
    return result


def _entries(part: Any, without: Collection[str]) -> dict[str, dict[str, Any]]:
    from smajax.core.parameters import get_parameters, parameters

    return {
        one.name: {
            "value": float(get_parameters(part, [one.name])[0]),
            "unit": one.unit,
            "bounds": [one.low, one.high],
            "meaning": one.about,
        }
        for one in parameters(part).values()
        if not {one.name, str(one.path[0])} & {*without}
    }


def _write(names: Sequence[str], out: Path) -> None:
    """A model file of three presets. Raises typer.BadParameter."""
    from smajax.data.experiment.errors import ExperimentError
    from smajax.data.model_file.of_presets import model_of_presets
    from smajax.model.presets import DRIVES, LOADS, WIRES

    kinds: list[Collection[str]] = [WIRES, LOADS, DRIVES]
    if len(names) != len(kinds) or any(name not in kind for name, kind in zip(names, kinds, strict=True)):
        raise typer.BadParameter(
            "expected a wire, a load and a drive before it, such as `flexinol_table_3_2 dead_weight voltage`",
            param_hint="--out",
        )
    if out.exists():
        raise typer.BadParameter(f"{out} exists; give another name.", param_hint="--out")
    try:
        path = model_of_presets(*names).save(out)
    except (ExperimentError, ValueError) as error:
        raise typer.BadParameter(str(error), param_hint="--out") from None
    typer.echo(f"Written: {path.resolve()}")


def presets(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            help="a wire, a load, a drive, a controller: list their parameters", autocompletion=completion.presets
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="write a wire, a load and a drive as a model file, to be changed into your own bench's"),
    ] = None,
    json_out: Json = False,
) -> None:
    """List the wires with their sizes, the loads and drives that an experiment file may name, and the controllers of the arm.

    With names: the parameters of these presets, with value, unit, bounds and meaning.

    Example:  smajax presets

    Example:  smajax presets flexinol_table_3_2 dead_weight voltage

    Example:  smajax presets flexinol_table_3_2 dead_weight voltage --out my_bench.toml
    """
    from smajax.core.runtime import prepare

    prepare()
    if out is not None:
        _write(names or [], out)
        return
    with until_pipe_closes():
        _list(names or [], json_out)


def _list(names: Sequence[str], json_out: bool) -> None:
    from smajax.control.presets import CONTROLLERS

    if names:
        parts = _parts(names)
        if json_out:
            typer.echo(json.dumps(parts))
            return
        for name, entries in parts.items():
            scaled = "  (gains of the arm, which are scaled to other loads)" if name in CONTROLLERS else ""
            typer.echo(name + scaled if entries else f"{name}  (no parameters)")
            rows = [
                [
                    f"  {one}",
                    f"{entry['value']:.5g} {entry['unit']}".removesuffix(" -"),
                    f"{entry['bounds'][0]:g} to {entry['bounds'][1]:g}",
                    entry["meaning"],
                ]
                for one, entry in entries.items()
            ]
            for line in aligned(rows) if rows else ():
                typer.echo(line.rstrip())
        return
    from smajax.core.parameters import parameter_values, parameters
    from smajax.model.presets import DRIVES, LOADS, WIRES
    from smajax.model.wire.laws import LAWS

    sizes: dict[str, dict[str, dict[str, Any]]] = {}
    for name, make in WIRES.items():
        wire = make()
        units, values = parameters(wire), parameter_values(wire)
        sizes[name] = {one: {"value": values[one], "unit": units[one].unit} for one in ("wire_diameter", "wire_length")}
    entry = {
        "wires": list(WIRES),
        "loads": list(LOADS),
        "drives": list(DRIVES),
        "controllers": list(CONTROLLERS),
        "laws": list(LAWS),
    }
    if json_out:
        typer.echo(json.dumps({**entry, "wire_sizes": sizes}))
        return
    for kind, names in entry.items():
        typer.echo(f"{kind}: {', '.join(names)}")
        if kind == "wires":
            for name, size in sizes.items():
                diameter, length = (size[one]["value"] for one in ("wire_diameter", "wire_length"))
                typer.echo(f"  {name}: diameter {1e3 * diameter:.4g} mm, length {1e3 * length:.4g} mm")
        if kind == "drives":  # several are a voltage
            for name, drive in DRIVES.items():
                typer.echo(f"  {name}: {(drive.__doc__ or '').splitlines()[0]}")
