"""The plant of a command: options that name its parts, and the system that they mean.

A command takes them as one parameter, `plant: PlantOptions` or `plant: LoopPlants`, and is decorated by `with_plant_options`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

from smajax.cli import completion
from smajax.cli.options import refused, texts

if TYPE_CHECKING:
    from smajax.control.plants import Plants
    from smajax.control.position_unit import PositionUnit
    from smajax.control.run_notes import LimitOfFitRuns
    from smajax.data.model_file.actuator_model import ActuatorModel
    from smajax.model.system import System
    from smajax.report.next_steps import PlantWords

ModelFile = Annotated[
    Path | None,
    typer.Option("--model", help="a model.toml of close-loop or identify, in the place of --wire, --load and --drive"),
]
Drawn = Annotated[
    int | None,
    typer.Option(
        "--plants",
        min=0,
        help="plants drawn from the posterior of --model, in the place of mismatches (default 16, 0 for none); of more than two mismatches of `sweep --over` those that are spread over all of them (default 64)",
    ),
]
OtherPlant = Annotated[
    Path | None,
    typer.Option(
        "--plant",
        help="closed loops on this other model file, whose controller knows --model (or wire, load and drive)",
    ),
]
DRAWN = 16
FEW = 3  # set points with --fast, over the stroke
FAST_OF_ARM = (-20.0, 20.0, 60.0)  # deg
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
    typer.Option("--drive", help="what heats it: a drive of `smajax presets`", autocompletion=completion.drives),
]
LawName = Annotated[
    str,
    typer.Option(
        "--law",
        help="kinetics: tanaka, liang, brinson or enhanced; integrated: enhanced, with strain a function of state, so that cycles close",
        autocompletion=completion.laws,
    ),
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


def loaded(path: Path) -> ActuatorModel:
    """The model of a file; stderr says what of it was changed by hand or is not finished. Raises ExperimentError."""
    from smajax.data.model_file.read import load_model

    model = load_model(path)
    for sentence in model.warnings:
        typer.echo(f"note: {sentence}.", err=True)
    return model


@dataclass(frozen=True)
class PlantOptions:
    """As typed; the defaults are the arm of the source."""

    wire: WireName = ""
    load: LoadName = ""
    drive: DriveName = ""
    law: LawName = ""
    values: Changes = None
    model: ModelFile = None

    @property
    def by_parts(self) -> bool:
        """Whether presets are named."""
        return bool(self.wire or self.load or self.drive or self.law)

    def words(self) -> PlantWords:
        """As a command names it."""
        from smajax.report.next_steps import PlantWords

        parts = (self.wire, self.load, self.drive) if self.wire else None
        return PlantWords(parts, self.law, str(self.model or ""), tuple(self.values or ()))

    @cached_property
    def kept(self) -> ActuatorModel | None:
        """The model of --model. Raises ExperimentError, and typer.BadParameter where presets are named beside it."""
        if self.model is None:
            return None
        if self.by_parts:
            raise typer.BadParameter(
                "says wire, load, drive and law: leave --wire, --load, --drive and --law out.", param_hint="--model"
            )
        return loaded(self.model)

    @property
    def _changed(self) -> dict[str, str]:
        return texts("--set", self.values or (), EXAMPLE)

    def bare(self) -> System:
        """The plant, whose command has the limit of its drive. Raises as `system`."""
        return self._made(None, False)[0]

    def system(self, limit: float | None = None, said: bool = True) -> System:
        """The plant of closed loops; its limit of the command is that of --set, else `limit`, else that of the fit runs, which stderr says.

        Raises typer.BadParameter for presets there are not, or some without the others; ExperimentError of --model.
        """
        from smajax.control.model_as_plant import input_lag_left_out
        from smajax.report.loop_words import source_sentence

        system, of_runs = self._made(limit, True)
        for source in (of_runs, *input_lag_left_out(self.kept)):
            if source is not None and said:
                typer.echo(source_sentence(source), err=True)
        return system

    def _made(self, limit: float | None, limited: bool) -> tuple[System, LimitOfFitRuns | None]:
        """(the plant; its limit where it is that of the model's runs)."""
        from smajax.control.compose import compose, with_values
        from smajax.control.model_as_plant import gives_limit, plant_of, with_limit
        from smajax.model.extended import without_input_lag
        from smajax.model.rigs import arm

        named = {"--wire": self.wire, "--load": self.load, "--drive": self.drive}
        missing = [option for option, name in named.items() if not name]
        if self.kept is None and 0 < len(missing) < len(named):
            raise typer.BadParameter(
                f"a plant is a wire, a load and a drive: give {' and '.join(missing)} too (`smajax presets` lists them)."
            )
        changed = self._changed
        try:
            if self.kept is not None:
                if limited:
                    return plant_of(self.kept, changed, limit)
                return without_input_lag(with_values(self.kept.system, changed)), None
            if missing:
                system = with_values(arm(self.law) if self.law else arm(), changed)
            else:
                system = compose(self.wire, self.load, self.drive, law=self.law, values=changed)
        except KeyError as error:
            raise typer.BadParameter(error.args[0]) from None
        except ValueError as error:
            raise typer.BadParameter(str(error), param_hint="--set" if changed else None) from None
        return system if gives_limit(changed) else with_limit(system, limit), None

    @property
    def gives_limit(self) -> bool:
        """Whether --set has the limit of the command."""
        from smajax.control.model_as_plant import gives_limit

        return gives_limit(self._changed)

    def noise(self, text: str, unit: PositionUnit) -> tuple[float, str]:
        """(noise of the readings in the unit shown: that of --noise, else that of the model's file, else none; a sentence on the second)."""
        from smajax.cli.loop_options import noise_option
        from smajax.control.model_as_plant import noise_of_file
        from smajax.report.loop_words import source_sentence

        typed = noise_option(text, unit)
        if typed is not None:
            return typed, ""
        source = noise_of_file(self.kept)
        own = 0.0 if source is None else source.noise
        return float(f"{float(unit.of(own)):.6g}"), source_sentence(source)


@dataclass(frozen=True)
class LoopPlants(PlantOptions):
    """The plant that controllers assume, and those that their closed loops run on."""

    drawn: Drawn = None
    plant: OtherPlant = None

    def words(self) -> PlantWords:
        return replace(super().words(), other=str(self.plant or ""))

    def plants(self, seed: int, others: bool, limit: float | None = None) -> Plants | None:
        """The plant of --plant, or plants from the posterior of the model; None for none. others: whether mismatches are asked for too.

        limit: as `system`'s. Raises typer.BadParameter for plants without a model, or of one of which nothing was fitted, and for a plant
        with another wire's law, load or drive.
        """
        if self.plant is None:
            return self._draws(self.drawn, seed, others, limit)
        if others or self.drawn:
            raise typer.BadParameter(
                "is one plant in the place of drawn ones and of mismatches: give one of these.", param_hint="--plant"
            )
        from smajax.control.model_as_plant import one_plant

        with refused("--plant"):
            return one_plant(loaded(self.plant), self.system(limit, said=False))

    def _draws(self, count: int | None, seed: int, others: bool, limit: float | None) -> System | None:
        """As `plants`, stacked."""
        if self.kept is None:
            if count:
                raise typer.BadParameter(
                    "are drawn from a model's posterior, or differ in more than two mismatches: give --model, or `sweep --over` with three names.",
                    param_hint="--plants",
                )
            return None
        if others and count:
            raise typer.BadParameter(
                "plants are drawn, or differ by mismatches: give one of the two.", param_hint="--plants"
            )
        fitted = any(one.names for one in self.kept.likely)
        if count and not fitted:
            raise typer.BadParameter(
                f"{self.model} has no covariance of fitted values, so that nothing can be drawn: leave it out.",
                param_hint="--plants",
            )
        wanted = (0 if others or not fitted else DRAWN) if count is None else count
        if not wanted:
            return None
        import numpy as np

        from smajax.control.model_as_plant import with_limit, within_limit
        from smajax.core.parameters import parameter_values, parameters, set_parameters
        from smajax.model.extended import without_input_lag

        plants = self.kept.plants(wanted, seed)
        plants = within_limit(self.kept, plants) if limit is None else with_limit(without_input_lag(plants), limit)
        if not self._changed:
            return plants
        own, changed = self.kept.values, parameter_values(self.system(limit, said=False))
        values = {name: value for name, value in changed.items() if value != own.get(name) or name in self._changed}
        if new := sorted(values.keys() - parameters(plants).keys()):
            raise typer.BadParameter(
                f"{new[0]} is of an effect that the model has not: with --set of it give --plants 0.",
                param_hint="--plants",
            )
        return set_parameters(plants, {name: np.full(wanted, value) for name, value in values.items()})


def with_plant_options(command: Callable[..., None]) -> Callable[..., None]:
    """`command` for typer, with the options of its plant in the place of its parameter `plant`, whose annotation has them as fields."""
    own = inspect.signature(command, eval_str=True)
    group = own.parameters["plant"].annotation
    types, names = get_type_hints(group, include_extras=True), [one.name for one in fields(group)]
    options = [
        inspect.Parameter(one.name, inspect.Parameter.KEYWORD_ONLY, default=one.default, annotation=types[one.name])
        for one in fields(group)
    ]

    def run(**given: Any) -> None:
        command(plant=group(**{name: given.pop(name) for name in names}), **given)

    several: list[inspect.Parameter] = []
    for name, one in own.parameters.items():
        several += options if name == "plant" else [one.replace(kind=inspect.Parameter.KEYWORD_ONLY)]
    run.__name__, run.__doc__, run.__module__ = command.__name__, command.__doc__, command.__module__
    run.__signature__ = inspect.Signature(several)  # type: ignore[attr-defined]
    run.__annotations__ = {one.name: one.annotation for one in several}
    return run


def set_points_of(plant: System, text: str | None, fast: bool) -> dict[str, tuple[float, ...]]:
    """The field `set_points` of settings, in the unit shown: as typed, few with --fast, and none where their own default holds."""
    from smajax.cli.options import numbers
    from smajax.control.position_unit import default_set_points, unit_of
    from smajax.control.scales import is_arm

    if text is not None:
        return {"set_points": numbers("--set-points", text, unit_of(plant).shown)}
    if not fast:
        return {}
    return {"set_points": FAST_OF_ARM if is_arm(plant) else default_set_points(plant, FEW)}
