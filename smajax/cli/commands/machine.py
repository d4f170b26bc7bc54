"""`smajax doctor` and `smajax bench`: what smajax runs on, and how fast it is there."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from smajax.cli.options import UNMET, Json, console, resumable, within


def doctor(
    clear_cache: Annotated[bool, typer.Option("--clear-cache", help="delete the compiled programs first")] = False,
    json_out: Json = False,
) -> None:
    """Say what smajax runs on and what is wrong with it: versions, devices, cache, memory, vectors of the processor.

    Exit code 3 when something is. Put the answer of `smajax doctor --json` into a report of a defect.

    Example:  smajax doctor
    """
    from smajax.core.runtime import prepare

    prepare()
    from smajax.cli import installation as surgery
    from smajax.core.wording import counted

    freed = surgery.clear_cache() if clear_cache else None
    found = surgery.examined()
    wrong = surgery.remarks(found)
    if json_out:
        typer.echo(json.dumps({**found, "remarks": wrong, "freed_bytes": freed}))
    else:
        if freed is not None:
            typer.echo(f"Deleted {freed / 1e6:.1f} MB of compiled programs.")
        for line in told(found):
            typer.echo(line)
        for line in wrong:
            typer.echo(f"! {line}")
        typer.echo("Nothing is wrong." if not wrong else f"{counted(len(wrong), 'remark')}.")
    if wrong:
        raise typer.Exit(UNMET)


def told(found: dict[str, object]) -> list[str]:
    """The same for a terminal."""
    from typing import cast

    one = cast(dict[str, Any], found)
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
        f"python {here['python']}, {here['system']}, {here['processor']}, {here['cores']} cores",
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


def _engine(found: dict[str, Any]) -> str:
    """Which engine runs, and why not the other."""
    if not found:
        return "engine: not tried, because of the plug-ins"
    if found["runs"] == "native":
        return f"engine: machine code, vectors of {found['vector_bits']} bits; SMAJAX_ENGINE=xla asks for XLA"
    return f"engine: {'XLA' if found['runs'] == 'xla' else 'none'}, because {found['why']}"


def bench(
    count: Annotated[int, typer.Option(callback=within(64), help="trajectories by smajax")] = 8192,
    peers: Annotated[int, typer.Option(callback=within(1), help="of them by scipy too")] = 16,
    out: Annotated[Path | None, typer.Option(help="file to write the numbers to, JSON")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="write over that file")] = False,
    json_out: Json = False,
) -> None:
    """Time the arm in many variants against scipy's LSODA on the same trajectories: a ratio, in under a minute.

    Exit code 3 when the two disagree.

    Example:  smajax bench --count 20000
    """
    if out is not None and out.exists() and not overwrite:
        raise typer.BadParameter(f"{out} exists; give another name, or --overwrite.", param_hint="--out")
    from smajax.core.runtime import prepare

    prepare(cores=True)
    from smajax.cli.benchmark import bench as timed
    from smajax.cli.benchmark import in_words
    from smajax.cli.progress_display import displayed
    from smajax.core.files import json_text, replace

    with resumable(), displayed(console()) as progress:
        found = timed(count, min(peers, count), progress)
    if out is not None:
        replace(out, json_text(found))
    if json_out:
        typer.echo(json.dumps(found))
    else:
        for line in in_words(found):
            typer.echo(line)
    if not found["agree"]:
        raise typer.Exit(UNMET)
