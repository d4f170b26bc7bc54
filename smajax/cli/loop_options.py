"""Options of the commands that run closed loops."""

from __future__ import annotations

from typing import Annotated

import typer

from smajax.cli import completion
from smajax.cli.options import quantity, within

LoopSeconds = Annotated[
    float | None,
    quantity("length of each closed loop; default 10 s, longer of a wire that cools more slowly", "s", 0.1, 86_400.0),
]
Estimator = Annotated[
    str,
    typer.Option(help="`printed` or `model` filter; default: the true state", autocompletion=completion.estimators),
]
Period = Annotated[float, quantity("sample time of the controller, a multiple of 10 ms", "s")]
Delay = Annotated[int, typer.Option(callback=within(0), help="control periods until a command arrives")]
