"""`smajax export`: a model or a controller as C99 or as an FMU."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from smajax.cli.loop_options import Delay, Estimator, Period
from smajax.cli.options import Json, refused, within
from smajax.cli.plant_options import PlantOptions, loaded, with_plant_options

if TYPE_CHECKING:
    from smajax.export.source import CSource
    from smajax.model.system import System


ARITHMETIC = {"single": "float", "double": "double"}  # option -> C's type


# More than 8 parameters: typer reads the options from them.
@with_plant_options
def export(
    file: Annotated[
        Path | None,
        typer.Argument(
            help="model.toml (or its folder) of close-loop or identify; gains.json of tune; none: the presets of --wire, --load and --drive"
        ),
    ] = None,
    *,
    to: Annotated[str, typer.Option("--to", help="`fmu`, or `c` for C99")],
    out: Annotated[
        Path | None,
        typer.Option(help="the .fmu file, or the folder of the C; default: named after FILE or the presets, here"),
    ] = None,
    fmi: Annotated[str, typer.Option(help="version of the interface of an FMU: 2.0 or 3.0")] = "2.0",
    plant: PlantOptions,
    estimator: Estimator = None,
    period: Period = None,
    delay: Delay = None,
    tolerance: Annotated[
        float,
        typer.Option(help="of a model: error of a step, a share of 1 C and of 1 % strain", callback=within(1e-9, 1e-2)),
    ] = 1e-5,
    source_only: Annotated[
        bool, typer.Option("--source-only", help="an FMU without a binary, for the importing tool to compile")
    ] = False,
    arithmetic: Annotated[
        str | None,
        typer.Option(
            help="of C that is compiled with single-precision inputs and outputs: `single` or `double`; default: single where that was measured to "
            "change no command by 1e-5 of the largest"
        ),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace files of the same name")] = False,
    json_out: Json = False,
) -> None:
    """Take a model or a tuned controller out of Python: an FMU for Simulink and others, or C99 for a microcontroller.

    Of gains --wire, --load and --drive, or --model, say which plant the controller assumes; default: the arm. Without a file they are the
    model, before there is anything measured. Nothing of Python or JAX is in what is written.

    Example:  smajax export report/model.toml --to fmu --out actuator.fmu

    Example:  smajax export --to fmu --wire flexinol_ht_500um --load bias_spring --drive voltage

    Example:  smajax export tuned/gains.json --to c --model report/model.toml --estimator model --out bench
    """
    from smajax.core.runtime import prepare

    prepare()
    from smajax.core.files import json_text
    from smajax.export.block import identifier
    from smajax.export.source import record
    from smajax.export.write import c_paths, check_free, write_c, write_fmu

    if to not in ("c", "fmu"):
        raise typer.BadParameter(f"`c` or `fmu`, not `{to}`.", param_hint="--to")
    if fmi not in ("2.0", "3.0"):
        raise typer.BadParameter(f"`2.0` or `3.0`, not `{fmi}`.", param_hint="--fmi")
    if arithmetic not in (None, *ARITHMETIC):
        raise typer.BadParameter(f"`single` or `double`, not `{arithmetic}`.", param_hint="--arithmetic")
    if arithmetic is not None and to == "fmu":
        raise typer.BadParameter("of `--to c`; an FMU computes in double precision.", param_hint="--arithmetic")
    stem = _stem(file, plant)
    path = out or (Path(f"{stem}.fmu") if to == "fmu" else Path(f"{stem}_c"))
    name = identifier(path.stem if to == "fmu" else stem)
    check_free([path] if to == "fmu" else c_paths(path, name), overwrite)
    source = _source(file, plant, name, estimator, period, delay, tolerance, arithmetic)
    if to == "fmu":
        written = [write_fmu(source, path, fmi, not source_only, overwrite)]
    else:
        written = write_c(source, path, overwrite)
    if json_out:
        typer.echo(json_text({**record(source), "files": [str(one) for one in written]}), nl=False)
        return
    _print(source, written, to)


def _stem(file: Path | None, plant: PlantOptions) -> str:
    """What is written is named after. Raises typer.BadParameter without a file and presets."""
    if file is not None:
        return file.parent.resolve().name if file.stem in ("model", "gains") and file.parent.name else file.stem
    if plant.model is not None:
        raise typer.BadParameter(f"of a model: give it as FILE, `smajax export {plant.model}`.", param_hint="--model")
    if not (plant.wire or plant.load or plant.drive):
        raise typer.BadParameter(
            "a model.toml, a gains.json, or the presets of --wire, --load and --drive; `smajax presets` lists them.",
            param_hint="FILE",
        )
    return f"{plant.wire}_{plant.load}"


# More than 8 parameters: the command's options, handed on.
def _source(
    file: Path | None,
    plant: PlantOptions,
    name: str,
    estimator: str | None,
    period: float | None,
    delay: int | None,
    tolerance: float,
    arithmetic: str | None,
) -> CSource:
    """Raises typer.BadParameter for options of the other kind of file, ExportError for what cannot be exported."""
    from smajax.control.gains_file import GainsFileError
    from smajax.export.from_files import controller_source, plant_source

    kind = None if arithmetic is None else ARITHMETIC[arithmetic]
    if file is not None and file.suffix == ".json":
        if period is not None and period <= 0.0:
            raise typer.BadParameter(f"more than 0 s, not {period:g} s.", param_hint="--period")
        system = plant.system()
        try:
            return controller_source(
                system,
                file,
                name,
                estimator=estimator,
                period=period,
                delay=delay,
                own_limit=plant.gives_limit,
                arithmetic=kind,
            )
        except GainsFileError as error:
            raise typer.BadParameter(str(error), param_hint="FILE") from None
        except KeyError as error:
            raise typer.BadParameter(str(error.args[0]), param_hint="--estimator") from None
    if any(one is not None for one in (estimator, delay, period)) or (file and (plant.model or plant.by_parts)):
        raise typer.BadParameter(
            "--estimator, --period and --delay are for gains.json, and --model, --wire, --load, --drive and --law for that or for no file; a model "
            "file says all of a model but what --set changes.",
            param_hint="FILE",
        )
    system, title = _of_presets(plant) if file is None else _model(file, plant.values or [])
    return plant_source(system, name, title, tolerance, kind or "double")


def _of_presets(plant: PlantOptions) -> tuple[System, str]:
    """(the system of named presets, its title). Raises typer.BadParameter."""
    return plant.bare(), f"Model of an actuator: {plant.wire}, {plant.load}, {plant.drive}"


def _model(file: Path, values: list[str]) -> tuple[System, str]:
    """(the system of a model file, its title). Raises ExperimentError of the file, typer.BadParameter of --set."""
    from smajax.cli.options import texts
    from smajax.cli.plant_options import EXAMPLE
    from smajax.control.compose import with_values

    kept = loaded(file)
    with refused("--set"):
        return with_values(kept.system, texts("--set", values, EXAMPLE)), f"Model of an actuator: {kept.title}"


def _print(source: CSource, written: list[Path], to: str) -> None:
    """What was written, for a terminal."""
    from smajax.export.single_precision import DOUBLE, SINGLE

    block, sizes = source.block, source.state_bytes
    every = "" if block.period is None else f", called every {1e3 * block.period:g} ms"
    typer.echo(f"{block.title}{every}")
    for label, many in (("inputs", source.inputs), ("outputs", source.outputs)):
        typer.echo(f"  {label}: {', '.join(f'{one.name} [{one.unit}]' for one in many)}")
    typer.echo(f"  parameters: {len(source.parameters)}")
    typer.echo(f"  state: {sizes[DOUBLE]} bytes in double precision, {sizes[SINGLE]} in single")
    if to == "c":
        single = source.single_build
        kept = "all of it single" if single.arithmetic == SINGLE else "inputs and outputs single, arithmetic double"
        typer.echo(f"  with -DSMAJAX_SINGLE=1: {kept}. {single.accuracy()}")
    for path in written:
        typer.echo(f"Written: {path.resolve()}")
