"""The command line: which commands there are. Each is a file in `commands/`."""

from __future__ import annotations

import atexit
import gc
import sys
import warnings
from collections.abc import Callable
from typing import Annotated

import typer

from smajax.cli.commands.app import app as app_command
from smajax.cli.commands.bench import bench
from smajax.cli.commands.check import check_command
from smajax.cli.commands.close_loop import close_loop_command
from smajax.cli.commands.demo import demo
from smajax.cli.commands.doctor import doctor
from smajax.cli.commands.effects import effects
from smajax.cli.commands.export import export
from smajax.cli.commands.figures import figures
from smajax.cli.commands.identify import identify_command
from smajax.cli.commands.new_experiment import new_experiment
from smajax.cli.commands.predict import predict_command
from smajax.cli.commands.presets import presets
from smajax.cli.commands.reports import reports
from smajax.cli.commands.simulate import simulate
from smajax.cli.commands.sweep import sweep
from smajax.cli.commands.tune import tune
from smajax.cli.positional import Command
from smajax.cli.renamed import with_new_names
from smajax.cli.terminal import answer_interrupts, console, last_words
from smajax.core.operating_system import no_room

EXIT_CODES = """\
Exit codes: 0 success; 1 a defect of smajax, with a traceback; 2 wrong input or options, with a message; 3 success, but the
result does not meet a requirement (a limit of tune, a claim of figures); 130 interrupted by Ctrl-C, after which the same
command resumes from cached results.

A folder that holds another result is refused; --overwrite deletes that result and no other file. Progress is drawn in a
terminal only; SMAJAX_PROGRESS=lines writes one line a stage to stderr elsewhere, and SMAJAX_PROGRESS=json each event as a line
of JSON, for a program. SMAJAX_ENGINE=xla runs every program by XLA, not by smajax's own compiler.
"""

app = typer.Typer(
    name="smajax",
    help="Shape-memory-alloy wire actuators: from measured runs to the physical effect that a model lacks.",
    epilog=EXIT_CODES,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=True,
    rich_markup_mode=None,  # plain help is quick
)


def _version(requested: bool) -> None:
    if requested:
        from smajax import __version__

        typer.echo(f"smajax {__version__}")
        raise typer.Exit


@app.callback()
def _all(
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_version, help="print the version")
    ] = False,
) -> None:
    pass


# In the order in which they are listed: the way from logs to a controller first.
COMMANDS: dict[str, Callable[..., None]] = {
    "app": app_command,
    "new-experiment": new_experiment,
    "check": check_command,
    "identify": identify_command,
    "close-loop": close_loop_command,
    "predict": predict_command,
    "tune": tune,
    "simulate": simulate,
    "sweep": sweep,
    "export": export,
    "reports": reports,
    "presets": presets,
    "effects": effects,
    "demo": demo,
    "figures": figures,
    "doctor": doctor,
    "bench": bench,
}
for _name, _function in COMMANDS.items():
    app.command(_name, cls=Command)(_function)


def _no_memory(error: Exception) -> bool:
    """Whether memory ran out: of a value, or of a part of a library that was to be loaded."""
    return isinstance(error, MemoryError) or (
        isinstance(error, ImportError) and ("failed to map" in str(error) or "cannot allocate" in str(error).lower())
    )


def _warned(message: Warning | str, *_: object, **__: object) -> None:
    """Print the message of a warning alone: its line of code says nothing to a user of the command line."""
    sys.stderr.write(f"warning: {message}\n")


def main() -> None:
    """Entry point. Errors that a user can correct are one paragraph with exit code 2, without a traceback."""
    warnings.showwarning = _warned
    # When the process ends Python looks for garbage among the millions of objects of traced programs: a second after the last word.
    atexit.register(gc.freeze)
    words, messages = with_new_names(sys.argv[1:])
    for message in messages:
        sys.stderr.write(f"deprecated: {message}\n")
    try:
        with answer_interrupts(), last_words():  # from here on, since imports of a command call back too
            app(words)
    except Exception as error:
        if _no_memory(error):
            # Plain text: a library for colours would need memory that is not left.
            sys.stderr.write(
                f"Error: not enough memory ({error or 'none left'}); take a longer step or shorter runs, or allow more. "
                "Finished results are cached.\n"
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
        from smajax.export.errors import ExportError

        if isinstance(error, OSError) and no_room(error):
            error = OSError(
                f"{error.filename or 'the disk'}: {error.strerror}: free some space and give the same command again. Finished "
                "results are cached."
            )
        elif not isinstance(
            error,
            (
                EngineError,
                ExperimentError,
                ExportError,
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
