"""`smajax demo`: `close-loop` on two virtual benches."""

from __future__ import annotations

import json
from importlib import resources
from pathlib import Path
from typing import Annotated

import typer

from smajax.cli import completion
from smajax.cli.commands.close_loop import load, print_findings, run_close_loop, tune_on_models
from smajax.cli.options import DEMOS, Json, Open, Overwrite
from smajax.cli.terminal import browse
from smajax.core.worker_process import OF_ATTRIBUTION, worker_process

TRUE_MODEL = "true_model.toml"
CONTROLLERS = ("pid", "sld")


def demo(
    out: Annotated[Path, typer.Option(help="folder for the reports")] = Path("demo-report"),
    only: Annotated[
        str | None, typer.Option(help=f"one of {', '.join(DEMOS)}", autocompletion=completion.demos)
    ] = None,
    control: Annotated[
        bool, typer.Option("--control/--no-control", help="tune controllers on the models of `latent` in the end")
    ] = True,
    overwrite: Overwrite = False,
    json_out: Json = False,
    open_page: Open = False,
) -> None:
    """Run `close-loop` on two virtual benches of the package: the base model of one lacks an effect, that of the other none.

    The data of each bench are from an independent simulator. Its true effects are in truth.toml, which `close-loop` does
    not read and which is printed after each verdict. In the end a controller with a model and one without are tuned on the fitted models of
    `latent` and evaluated on its true wire.

    Example:  smajax demo --only latent --out demo-report
    """
    if only is not None and only not in DEMOS:
        raise typer.BadParameter(f"there is no demo `{only}`; choose one of {', '.join(DEMOS)}.", param_hint="--only")
    from smajax.cli.result_folder import check_path

    pages: list[Path] = []
    records = {}
    for name in DEMOS if only is None else (only,):
        check_path(out / name)
        with resources.as_file(resources.files("smajax") / "data" / "demo" / name) as folder:
            if not json_out:
                typer.echo(f"\n=== {name} ===")
            with worker_process(OF_ATTRIBUTION):  # it starts while this one imports and reads
                findings, page = run_close_loop(
                    load(folder), out / name, f"smajax demo --only {name}", overwrite, not (json_out or pages)
                )
            if json_out:
                from smajax.report.json_file import findings_to_json

                records[name] = findings_to_json(findings)
            else:
                print_findings(findings, page)
                typer.echo("The truth, which the loop did not read:")
                for line in (folder / "truth.toml").read_text(encoding="utf-8").splitlines():
                    typer.echo(f"  {line}")
            if control and (folder / TRUE_MODEL).is_file():
                typer.echo(
                    "\nControllers tuned on what was found, and on the base model, evaluated on the true wire:",
                    err=True,
                )
                for controller in CONTROLLERS:
                    shown = tune_on_models(
                        findings, out / name, controller, (), "smajax demo", folder / TRUE_MODEL, quick=True
                    )
                    typer.echo(f"Controller: {shown.resolve()}", err=json_out)
        pages.append(page)
    if json_out:
        typer.echo(json.dumps(records))
    if open_page:
        for page in pages:
            browse(page)
