"""`smajax app`: the whole way in a browser on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from smajax.cli.options import within


def app(
    folder: Annotated[Path, typer.Argument(help="the working folder; nothing outside it is read or written")] = Path(),
    port: Annotated[
        int, typer.Option(callback=within(0, 65535), help="of the loopback (127.0.0.1); default one that is free")
    ] = 0,
    no_open: Annotated[bool, typer.Option("--no-open", help="print the address, and open no browser")] = False,
) -> None:
    """Open a page for the whole way: drop logs, map columns, choose the bench, fit, watch, read the verdict, predict, tune.

    It writes the same experiment.toml and result folders as the other commands, so that either goes on where the other stopped. It
    listens on the loopback only, and the address has a token. A fit goes on when the server is stopped: open the folder again. Needs the extra `app`.

    Example:  smajax app bench/
    """
    from smajax.core.extras import optional_package

    for package in ("starlette", "uvicorn", "python_multipart", "tomlkit"):
        optional_package(package, "app", "`smajax app`")
    from smajax.app.server import serve

    if not folder.is_dir():
        raise typer.BadParameter(f"there is no folder {folder}.", param_hint="FOLDER")

    def started(address: str) -> None:
        typer.echo(f"smajax app is at  {address}\nCtrl-C ends it.")
        if not no_open:
            import webbrowser

            webbrowser.open(address)

    try:
        serve(folder.resolve(), port, started)
    except OSError as error:
        raise typer.BadParameter(f"{port}: {error.strerror}; give another one.", param_hint="--port") from None
