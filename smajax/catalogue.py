"""What an experiment file may name: presets, effects, and every parameter of a combination with unit and bounds."""

from __future__ import annotations

from smajax.effects.library import LIBRARY
from smajax.experiment.catalogue import Catalogue, ModelDescription, ParameterInfo
from smajax.extended import extended
from smajax.load.coupon import AbstractCoupon
from smajax.parameters import parameters
from smajax.presets import DRIVES, LOADS, WIRES, build
from smajax.sensors import sensors_of
from smajax.system import System
from smajax.wire.laws import LAWS


def check_together(system: System, load: str, drive: str) -> None:
    """ValueError unless what is prescribed has no drive, and what is heated has one."""
    if isinstance(system.load, AbstractCoupon) != (drive == "none"):
        raise ValueError(
            f"load `{load}` with drive `{drive}`: a coupon's temperature is prescribed, so it takes the drive `none`; "
            f"every other load is heated and takes one of {sorted(set(DRIVES) - {'none'})}."
        )


def describe(wire: str, load: str, drive: str, law: str = "") -> ModelDescription:
    """Parameters and channels of one combination. ValueError when the three do not go together."""
    system = build(wire, load, drive, law)
    check_together(system, load, drive)
    # An effect is part of the base model when the experiment names a parameter of it.
    whole = extended(system, candidates(system, None, ()))
    return ModelDescription(
        parameters={
            entry.name: ParameterInfo(entry.unit, entry.low, entry.high) for entry in parameters(whole).values()
        },
        inputs_required=system.load.inputs_required | system.drive.inputs_required,
        inputs_optional=system.load.inputs_optional | system.drive.inputs_optional | {"ambient_temperature"},
        outputs=sensors_of(system),
        inputs_squared=system.drive.inputs_squared,
        inputs_sampled=system.load.inputs_required if isinstance(system.load, AbstractCoupon) else frozenset(),
    )


CATALOGUE = Catalogue(
    wires=tuple(WIRES),
    loads=tuple(LOADS),
    drives=tuple(DRIVES),
    laws=tuple(LAWS),
    effects=tuple(LIBRARY),
    describe=describe,
)


def candidates(
    system: System, only: tuple[str, ...] | None, excluded: tuple[str, ...], clocked: bool = True
) -> tuple[str, ...]:
    """Names of the effects that this system can show: a coupon has no heat balance, no circuit and no guide.

    `clocked`: whether the samples have times; where they have not, what is a matter of seconds is tried only if asked for.
    """
    useless = {"heat", "electrical", "mechanics"} if isinstance(system.load, AbstractCoupon) else set()
    return tuple(
        name
        for name, effect in LIBRARY.items()
        if effect.equation not in useless
        and effect.applies(system)
        and (clocked or not effect.needs_time or only is not None)
        and name not in excluded
        and (only is None or name in only)
    )
