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
        help=f"`printed` or `model` filter, '' for the true state; {OF_FILE} the true state",
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
        help="noise of the readings (1 sigma), 0.1deg or 20um, without a unit in deg, or in mm of a length; default that of the model file, else none"
    ),
]


def noise_option(text: str, unit: PositionUnit) -> float | None:
    """A noise in the unit shown; None of "". Raises typer.BadParameter."""
    from smajax.control.interface import noise_of

    with refused("'--noise'"):
        return noise_of(text, unit) if text else None
