"""Options of the commands that run closed loops."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from smajax.cli import completion
from smajax.cli.options import quantity, refused, within

if TYPE_CHECKING:
    from smajax.control.position_unit import PositionUnit

LoopSeconds = Annotated[
    float | None,
    quantity("length of each closed loop; default 10 s, longer of a wire that cools more slowly", "s", 0.1, 86_400.0),
]
OF_FILE = "default that of the gains file, else"
Estimator = Annotated[
    str | None,
    typer.Option(
        help=f"extended Kalman filter `model`, `adaptive` (parameters too) or `printed` (of the source's arm), '' for the true state; {OF_FILE} the true state",
        autocompletion=completion.estimators,
    ),
]
Period = Annotated[
    float | None,
    quantity(f"sample time of the controller, a whole number of steps; {OF_FILE} 10 ms", "s"),
]
Delay = Annotated[
    int | None, typer.Option(callback=within(0), help=f"control periods until a command arrives; {OF_FILE} 0")
]
Noise = Annotated[
    str,
    typer.Option(
        help="noise of the readings (1 sigma), 0.1deg or 20um, without a unit in deg, or in mm of a length, also what the filters `model` and `adaptive` take for it; "
        "default that of the model file, else none"
    ),
]

# Of a sweep, whose controllers are on a filter where nobody says another.
FilterOfSweep = Annotated[
    str | None,
    typer.Option(
        "--estimator",
        help=f"`printed`, `model` or `adaptive` filter, '' for the true state, then without noise or delay; {OF_FILE} `adaptive`",
        autocompletion=completion.estimators,
    ),
]
DelayOfSweep = Annotated[
    int | None,
    typer.Option(
        "--delay", callback=within(0), help=f"control periods until a command arrives; {OF_FILE} 1, of the true state 0"
    ),
]
NoiseOfSweep = Annotated[
    str,
    typer.Option(
        "--noise",
        help="noise of the readings (1 sigma), 0.1deg or 20um, without a unit in deg, or in mm of a length; default that of the model file, else 0.1deg, or "
        "of a length what the same strain of the wire moves; none of the true state",
    ),
]
STEPS = "step between two values of the readings, 0.1deg or 20um, without a unit in deg, or in mm of a length; default"
Quantum = Annotated[str, typer.Option(help=f"{STEPS} none")]
QuantumOfSweep = Annotated[str, typer.Option("--quantum", help=f"{STEPS} as the noise, none where a noise is given")]


def noise_option(text: str, unit: PositionUnit, option: str = "--noise") -> float | None:
    """A noise, or a quantum, in the unit shown; None of "". Raises typer.BadParameter."""
    from smajax.control.signal_path import noise_of

    with refused(f"'{option}'"):
        return noise_of(text, unit) if text else None
