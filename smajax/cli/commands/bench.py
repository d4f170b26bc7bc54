"""`smajax bench`: smajax beside scipy on this machine."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from smajax.cli.options import UNMET, Json, within
from smajax.cli.terminal import console, resumable


def bench(
    count: Annotated[int, typer.Option(callback=within(64), help="trajectories by smajax")] = 8192,
    peers: Annotated[int, typer.Option(callback=within(1), help="trajectories by scipy, of the same ones")] = 16,
    out: Annotated[Path | None, typer.Option(help="file to write the numbers to, JSON")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace that file")] = False,
    json_out: Json = False,
) -> None:
    """Time many variants of the arm beside scipy's LSODA on the same trajectories, in under a minute.

    Exit code 3 when the two disagree.

    Example:  smajax bench --count 20000
    """
    if out is not None and out.exists() and not overwrite:
        raise typer.BadParameter(f"{out} exists; give another name, or --overwrite.", param_hint="--out")
    from smajax.core.runtime import prepare

    prepare(cores=True)
    from smajax.cli.benchmark import benchmark
    from smajax.cli.progress_display import displayed
    from smajax.core.files import json_text, replace

    with resumable(), displayed(console()) as progress:
        result = benchmark(count, min(peers, count), progress)
    if out is not None:
        replace(out, json_text(result))
    if json_out:
        typer.echo(json.dumps(result))
    else:
        for line in as_lines(result):
            typer.echo(line)
    if not result["agree"]:
        raise typer.Exit(UNMET)


def as_lines(result: dict[str, Any]) -> list[str]:
    """The result for a terminal."""
    from smajax.core.wording import counted

    here = result["machine"]
    return [
        f"{here['processor']}, {counted(here['cores'], 'core')}, {here['system']}, load {here['load at the start']}; "
        f"smajax {here['versions']['smajax']}, jax {here['versions']['jax']}, scipy {here['versions']['scipy']}",
        f"smajax:      {result['smajax_ms']:.4f} ms a trajectory ({result['trajectories']['smajax']:,} of "
        f"{result['trajectories']['seconds']:g} s, {counted(result['smajax_cores'], 'core')}; first call {result['smajax_first_call_s']:.1f} s)",
        f"scipy LSODA: {result['scipy_ms']:.2f} ms a trajectory ({result['trajectories']['scipy']} of them, one core)",
        f"smajax is {result['ratio']:.0f} times as fast, {result['ratio_per_core']:.0f} times a core; the angles differ by "
        f"{result['largest_difference_degrees']:.3f} degrees at most.",
    ]
