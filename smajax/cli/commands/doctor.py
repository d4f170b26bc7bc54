"""`smajax doctor`: what smajax runs on, and what is wrong with it."""

from __future__ import annotations

import json
from typing import Annotated, Any

import typer

from smajax.cli.options import UNMET, Json


def doctor(
    clear_cache: Annotated[bool, typer.Option("--clear-cache", help="delete the compiled programs first")] = False,
    json_out: Json = False,
) -> None:
    """Show what smajax runs on and what is wrong with it: versions, devices, cache, memory, vectors of the processor.

    Exit code 3 when something is wrong. Add the output of `smajax doctor --json` to a bug report.

    Example:  smajax doctor
    """
    from smajax.core.runtime import prepare

    prepare()
    from smajax.cli import installation
    from smajax.core.wording import counted

    freed = installation.clear_cache() if clear_cache else None
    result = installation.examine()
    wrong = installation.remarks(result)
    if json_out:
        typer.echo(json.dumps({**result, "remarks": wrong, "freed_bytes": freed}))
    else:
        if freed is not None:
            typer.echo(f"Deleted {freed / 1e6:.1f} MB of compiled programs.")
        for line in lines_of(result):
            typer.echo(line)
        for line in wrong:
            typer.echo(f"! {line}")
        typer.echo("Nothing is wrong." if not wrong else f"{counted(len(wrong), 'remark')}.")
    if wrong:
        raise typer.Exit(UNMET)


def lines_of(result: dict[str, object]) -> list[str]:
    """The result for a terminal."""
    from typing import cast

    one = cast(dict[str, Any], result)
    here, cache, engine, memory = (
        one["machine"],
        one["compiled programs"],
        one["engine"],
        one["memory"]["available_bytes"],
    )

    def versions(named: dict[str, str]) -> str:
        return ", ".join(f"{name} {version or '(none)'}" for name, version in sorted(named.items()))

    return [
        f"smajax {one['smajax']['version']} in {one['smajax']['folder']}",
        f"python {here['python']}, {here['system']}, {here['processor']}, {_cores(here)}",
        f"devices: {', '.join(one['devices'])}",
        f"float64: {'on' if one['float64'] else 'off'} in the commands; a program of your own switches it on itself, before its "
        "first array: smajax.prepare(), or jax.config.update('jax_enable_x64', True)",
        _engine(engine),
        f"memory free: {'unknown' if memory is None else f'{memory / 1e9:.1f} GB'}",
        f"compiled programs: {cache['folder']}, {cache['bytes'] / 1e6:.1f} MB; to clear: {cache['clear']}",
        f"packages: {versions(one['packages'])}",
        f"of extras: {versions(one['packages of extras'])}",
        f"plug-ins: {', '.join(one['plug-ins']) or 'none'}",
    ]


def _cores(machine: dict[str, Any]) -> str:
    """`2 cores`; `1 core that this process may use, of 2` where it is bound to some of them."""
    from smajax.core.wording import counted

    usable, whole = machine["cores"], machine["cores of the machine"]
    text = counted(usable, "core")
    return text if whole in (None, usable) else f"{text} that this process may use, of {whole}"


def _engine(result: dict[str, Any]) -> str:
    """Which engine runs, and why not the other."""
    if not result:
        return "engine: not tried, because of the plug-ins"
    if result["runs"] == "native":
        return f"engine: machine code, vectors of {result['vector_bits']} bits; SMAJAX_ENGINE=xla asks for XLA"
    return f"engine: {'XLA' if result['runs'] == 'xla' else 'none'}, because {result['why']}"
