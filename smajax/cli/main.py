"""The command line: which commands there are. Each is a file in `commands/`."""

from __future__ import annotations

import errno
import sys
import warnings
from collections.abc import Callable
from typing import Annotated

import typer

from smajax.cli.commands.close_loop import close_loop_command, demo
from smajax.cli.commands.figures import figures
from smajax.cli.commands.identify import identify_command
from smajax.cli.commands.listing import effects, presets
from smajax.cli.commands.machine import bench, doctor
from smajax.cli.commands.new_experiment import new_experiment
from smajax.cli.commands.simulate import simulate
from smajax.cli.commands.sweep import sweep
from smajax.cli.commands.tune import tune
from smajax.cli.options import console, insistent
from smajax.cli.positional import Command
from smajax.cli.renamed import as_now

EXIT_CODES = """\
Exit codes: 0 done; 1 a defect of smajax (a traceback says where); 2 input or options that cannot be used, with what to do;
3 done, and what was asked of the result is not met (a limit of tune, a claim of figures); 130 interrupted by Ctrl-C, after
which the same command goes on from what is kept.

A folder that holds another result is refused; --overwrite deletes that result, and nothing else that lies there. Progress
is drawn in a terminal only; SMAJAX_PROGRESS=lines writes a line a stage to stderr elsewhere. SMAJAX_ENGINE=xla has XLA run
every program in the place of smajax's own compiler.
"""

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)  # no room on the disk, in the quota, in a file

app = typer.Typer(
    name="smajax",
    help="Shape-memory-alloy wire actuators: from measured runs to the physical effect that a model lacks.",
    epilog=EXIT_CODES,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=True,
    rich_markup_mode=None,  # the plain help is there at once
)


def _version(asked: bool) -> None:
    if asked:
        from smajax import __version__

        typer.echo(f"smajax {__version__}")
        raise typer.Exit


@app.callback()
def _all(
    version: Annotated[bool, typer.Option("--version", is_eager=True, callback=_version, help="print it")] = False,
) -> None:
    pass


COMMANDS: dict[str, Callable[..., None]] = {
    "close-loop": close_loop_command,
    "identify": identify_command,
    "effects": effects,
    "presets": presets,
    "demo": demo,
    "figures": figures,
    "tune": tune,
    "sweep": sweep,
    "simulate": simulate,
    "doctor": doctor,
    "bench": bench,
    "new-experiment": new_experiment,
}
for _name, _function in COMMANDS.items():
    app.command(_name, cls=Command)(_function)


def _no_memory(error: Exception) -> bool:
    """Whether memory ran out: of a value, or of a part of a library that was to be loaded."""
    return isinstance(error, MemoryError) or (
        isinstance(error, ImportError) and ("failed to map" in str(error) or "cannot allocate" in str(error).lower())
    )


def _warned(message: Warning | str, *_: object, **__: object) -> None:
    """Of a warning what it says: the line of code that gave it means nothing to who typed a command."""
    sys.stderr.write(f"warning: {message}\n")


def main() -> None:
    """Entry point: errors that a user can mend are said in one paragraph with exit code 2, without a traceback."""
    warnings.showwarning = _warned
    typed, told = as_now(sys.argv[1:])
    for sentence in told:
        sys.stderr.write(f"deprecated: {sentence}\n")
    try:
        with insistent():  # from here on: what a command imports calls back too
            app(typed)
    except Exception as error:
        if _no_memory(error):
            # Written plainly: what colours a message would have to be loaded, and there is no memory left for it.
            sys.stderr.write(
                f"Error: not enough memory ({error or 'none left'}); take a longer step or shorter runs, or allow more. "
                "What was finished is kept.\n"
            )
            raise SystemExit(2) from None
        # Imported when there is an error: `--help` does not wait for them.
        from smajax.cli.result_folder import FolderTaken
        from smajax.core.extras import MissingExtraError
        from smajax.core.plugins import PluginError
        from smajax.core.units import UnitError
        from smajax.data.experiment.errors import ExperimentError
        from smajax.data.readers.table import MeasuredDataError
        from smajax.engine import EngineError

        if isinstance(error, OSError) and error.errno in FULL:
            error = OSError(
                f"{error.filename or 'the disk'}: {error.strerror}: free some space and give the same command again. What was "
                "finished is kept."
            )
        elif not isinstance(
            error,
            (
                EngineError,
                ExperimentError,
                FolderTaken,
                MeasuredDataError,
                MissingExtraError,
                OSError,
                PluginError,
                UnitError,
            ),
        ):
            raise
        console().print(f"Error: {error}", style="red", markup=False, highlight=False, soft_wrap=True)
        raise SystemExit(2) from None
