"""The plant of a command: options that name its parts, and the system that they mean."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated

import typer

from smajax.cli import completion
from smajax.cli.options import texts

if TYPE_CHECKING:
    from smajax.model.system import System

WireName = Annotated[
    str,
    typer.Option(
        "--wire",
        help="a wire of `smajax presets`, with --load and --drive; default: the arm",
        autocompletion=completion.wires,
    ),
]
LoadName = Annotated[
    str,
    typer.Option(
        "--load", help="what it moves: a load of `smajax presets` or your own", autocompletion=completion.loads
    ),
]
DriveName = Annotated[
    str,
    typer.Option("--drive", help="a drive of `smajax presets` that takes a voltage", autocompletion=completion.drives),
]
LawName = Annotated[
    str,
    typer.Option("--law", help="kinetics: tanaka, liang, brinson or enhanced", autocompletion=completion.laws),
]
Changes = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="parameters of the plant, load_mass='120 g' or latent_heat.enthalpy='20 J/g', which adds that effect; without a "
        "unit in SI, degC or rad; may be repeated",
        autocompletion=completion.values,
    ),
]
EXAMPLE = "damping=+20%,wire_length='1 m'"


@dataclass(frozen=True)
class PlantOptions:
    """As typed; the defaults are the arm of the source."""

    wire: str = ""
    load: str = ""
    drive: str = ""
    law: str = ""
    values: list[str] = field(default_factory=list)

    def system(self) -> System:
        """Raises typer.BadParameter for presets there are not, or some without the others."""
        from smajax.control.compose import compose, with_values
        from smajax.model.rigs import arm

        named = {"--wire": self.wire, "--load": self.load, "--drive": self.drive}
        missing = [option for option, name in named.items() if not name]
        if 0 < len(missing) < len(named):
            raise typer.BadParameter(
                f"a plant is a wire, a load and a drive: give {' and '.join(missing)} too (`smajax presets` lists them)."
            )
        changed = texts("--set", self.values, EXAMPLE)
        try:
            if missing:
                return with_values(arm(self.law) if self.law else arm(), changed)
            return compose(self.wire, self.load, self.drive, law=self.law, values=changed)
        except KeyError as error:
            raise typer.BadParameter(error.args[0]) from None
        except ValueError as error:
            raise typer.BadParameter(str(error), param_hint="--set" if changed else None) from None
