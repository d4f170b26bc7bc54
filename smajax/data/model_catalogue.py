"""What an experiment file may name: presets, effects, and every parameter of a combination with unit and bounds."""

from __future__ import annotations

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from smajax.core.names import listed
from smajax.core.parameters import all_by_numpy, by_numpy, parameter_values, parameters, set_parameters
from smajax.data.experiment.catalogue import Catalogue, CoefficientInfo, ModelDescription, ParameterInfo, Scale
from smajax.model.effects.candidate import PRIOR_ODDS
from smajax.model.effects.library import LIBRARY
from smajax.model.effects.prior_width import stated_width
from smajax.model.extended import extended
from smajax.model.load.coupon import AbstractCoupon
from smajax.model.presets import DRIVES, LOADS, WIRES, build
from smajax.model.system import System, heating_power
from smajax.model.types import Scalar
from smajax.model.wire.heat import mass_per_metre
from smajax.model.wire.laws import LAWS
from smajax.model.wire.order import disorder
from smajax.model.wire.resistance import resistance_per_metre
from smajax.simulation.sensors import sensors_of


def check_together(system: System, load: str, drive: str) -> None:
    """ValueError unless what is prescribed has no drive, and what is heated has one."""
    if isinstance(system.load, AbstractCoupon) != (drive == "none"):
        raise ValueError(
            f"load `{load}` with drive `{drive}`: a coupon's temperature is prescribed, so it takes the drive `none`; "
            f"every other load is heated and takes one of {listed(sorted(set(DRIVES) - {'none'}))}."
        )


def describe(wire: str, load: str, drive: str, law: str = "") -> ModelDescription:
    """Parameters and channels of one combination. ValueError when the three do not go together."""
    system = build(wire, load, drive, law)
    check_together(system, load, drive)
    # An effect is part of the base model when the experiment names a parameter of it.
    possible = applicable(system)
    whole = extended(system, possible)
    values = parameter_values(system)
    return ModelDescription(
        parameters={
            entry.name: ParameterInfo(entry.unit, entry.low, entry.high, values.get(entry.name), entry.also)
            for entry in parameters(whole).values()
        },
        inputs_required=system.load.inputs_required | system.drive.inputs_required,
        inputs_optional=system.load.inputs_optional | system.drive.inputs_optional | {"ambient_temperature"},
        outputs=sensors_of(system),
        inputs_squared=system.drive.inputs_squared,
        heats=system.drive.inputs_required,
        effects=frozenset(possible),
        scale=None if isinstance(system.load, AbstractCoupon) else lambda values: _scale(_at(system, values)),
        disorder=lambda values: disorder(_at(system, values)),
        inputs_sampled=system.load.inputs_required if isinstance(system.load, AbstractCoupon) else frozenset(),
    )


def _at(system: System, values: Mapping[str, float]) -> System:
    """The system without effects at those of the values that are its own."""
    table = parameters(system)
    return set_parameters(system, {name: value for name, value in values.items() if name in table})


@eqx.filter_jit  # one program, where each of its operations would be one
def _warming(system: System, resistance: Scalar, cooling: Scalar, given: Mapping[str, Array]) -> Array:
    """By how much a wire gets warmer than the air at rest, K; `resistance` and `cooling` of a metre, ohm and W/K."""
    return heating_power(system, resistance, given) / cooling


def _scale(system: System) -> Scale:
    """Of a wire all martensite, in still air: tau = rho c_p d / (4 h), T - T_inf = P / (h pi d) at rest (eq. 3.1)."""
    wire = all_by_numpy(system.wire)
    heat = wire.heat
    martensite, austenite = (
        resistance_per_metre(wire, (), heat.ambient_temperature, fraction)
        for fraction in by_numpy(jnp.asarray([1.0, 0.0]))
    )
    ohms = sorted(float(one * wire.wire_length) for one in (martensite, austenite))
    cooling = heat.convection_coefficient * np.pi * wire.wire_diameter

    def warming(inputs: Mapping[str, np.ndarray]) -> np.ndarray:
        count = max(map(len, inputs.values()), default=0)
        # Of a length that many logs share: JAX compiles it for each.
        more = (1 << max(count - 1, 0).bit_length()) - count
        given = {name: jnp.asarray(np.pad(values, (0, more), mode="edge")) for name, values in inputs.items()}
        found = np.asarray(_warming(system, jnp.asarray(martensite), jnp.asarray(cooling), given), dtype=np.float64)
        return found[:count] if found.ndim else found

    values = parameter_values(system.load)
    return Scale(
        float(wire.wire_length),
        float(heat.ambient_temperature),
        float(mass_per_metre(wire) * heat.specific_heat / cooling),
        warming,
        system.load.reading[0],
        (ohms[0], ohms[1]),
        {one.name: values[one.name] for one in parameters(system.load).values() if one.unit == "kg"},
    )


def coefficients(effect: str) -> dict[str, CoefficientInfo]:
    """Coefficients of an effect of the library, with what a prior of each may be."""
    kind, found = LIBRARY[effect], {}
    for entry in parameters(kind.base()).values():
        name = entry.name.removeprefix(f"{effect}.")
        width = stated_width(kind, name)
        found[name] = CoefficientInfo(
            entry.unit,
            entry.low,
            entry.high,
            switch=name in kind.candidate.switches,
            logarithmic=width.logarithmic,
            positive=(width.base or 0.0) > 0.0,
        )
    return found


CATALOGUE = Catalogue(
    wires=tuple(WIRES),
    loads=tuple(LOADS),
    drives=tuple(DRIVES),
    laws=tuple(LAWS),
    effects=tuple(LIBRARY),
    describe=describe,
    coefficients=coefficients,
    odds={str(name): odds for name, odds in PRIOR_ODDS.items()},
    groups={name: group for name, effect in LIBRARY.items() if (group := effect.candidate.exclusive_group)},
)


def applicable(system: System) -> tuple[str, ...]:
    """Names of the effects that can change anything of this system: a coupon has no heat balance, no circuit and no guide."""
    useless = {"heat", "electrical", "mechanics"} if isinstance(system.load, AbstractCoupon) else set()
    return tuple(
        name
        for name, effect in LIBRARY.items()
        if effect.candidate.equation not in useless and effect.candidate.applies(system)
    )


def candidates(
    system: System, only: tuple[str, ...] | None, excluded: tuple[str, ...], clocked: bool = True
) -> tuple[str, ...]:
    """Names of the effects that a search looks for: those that this system can show.

    None of a group of which the system has one already (`Candidate.exclusive_group`), unless `only` names it.
    `clocked`: whether the samples have times; where they have not, what is a matter of seconds is tried only if asked for.
    """
    taken = {effect.candidate.exclusive_group for effect in system.effects} - {""}
    return tuple(
        name
        for name in applicable(system)
        if (clocked or not LIBRARY[name].candidate.needs_time or only is not None)
        and (LIBRARY[name].candidate.exclusive_group not in taken or only is not None)
        and name not in excluded
        and (only is None or name in only)
    )
