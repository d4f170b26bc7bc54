"""What an integration leaves in the outputs, measured against a finer one, and the cheapest that leaves little enough.

The step of a run is the clock of its inputs and results. Between two of its samples a run may take one step, equal steps, or as many
as a tolerance asks for (`Integration`). Which is cheaper was measured on two cores (arm, 10 s, native code):

- One run by itself: compiling takes half a second and a run 6 to 10 ms, whichever it is, so that error-controlled steps cost nothing, and
  at a clock of 5 ms leave a tenth of the error. One program serves every tolerance, the finer one of the check too.
- A batch: at a clock of 5 ms one step a sample takes half of the time of error-controlled steps (57 and 110 microseconds a run), so it is
  taken where it leaves little enough; at 250 ms error-controlled steps leave less in a quarter of that. Sixteen runs of the batch tell.
- Derivatives along equal steps are those of where branches begin and end within them, which may have another sign than the model's; along
  error-controlled steps they are the model's. Reverse mode cannot go back through steps whose number is not known: it is for equal ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.coupon import Coupon
from smajax.model.system import System
from smajax.simulation.steppers import ONE_STEP, Integration

Tolerance = float | Literal["auto"] | None
AUTO: Literal["auto"] = "auto"

# One step a sample first: it is a scheme of order 2 with two stages, the others are of order 3 with three or more.
TOLERANCES = (1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6)
FINEST = 1e-8  # what the others are measured against in a fit
FINE = 1e-7  # in a simulation, whose values may be any: at 1e-8 wires from the ends of the declared bounds take 1.7 times the steps
FINE_AGAIN = 1e-8  # and of a closed loop, which may agree with the first one by chance
SUBSTEPS = (1, 2, 4, 8, 16, 32, 64)
MOST_SUBSTEPS = 256
ALONE = (1e-4, 1e-5, 1e-6)  # tolerances of a run by itself
# Of single precision, whose rounding an error estimate cannot be below.
TOLERANCES_SINGLE, FINEST_SINGLE = (1e-3,), 1e-4
LARGEST = 3e-4  # of a whole transformation: the error, rms over a run; its largest value is some ten times that, and below a hundredth
LEAST_STRAIN = 1e-3

Outputs = Mapping[str, np.ndarray]  # by name: over time of every run, (runs, time), or a number of every run, (runs,)
Result = TypeVar("Result")


@dataclass(frozen=True)
class IntegrationError:
    """What an integration leaves in the outputs, by output name, at the worst run: SI; of a fit, an offset that is fitted taken off.

    share: the largest root mean square, over the output's noise or its way through a whole transformation (`of`).
    description: how the runs were integrated. limit: what `share` is to stay below. against: what it was measured against.
    """

    rms: dict[str, float]
    largest: dict[str, float]
    share: float
    description: str
    of: str = "noise"
    limit: float = 0.1
    against: str = ""

    def record(self) -> dict[str, Any]:
        """For JSON."""
        aim = {"aimed_for": self.limit} if self.of == "stroke" else {}
        return {
            "how": self.description,
            **({"against": self.against} if self.against else {}),
            "outputs": {name: {"rms": rms, "largest": self.largest[name]} for name, rms in self.rms.items()},
            f"largest_rms_over_{self.of}": self.share,
            **aim,
        }

    @property
    def small(self) -> bool:
        """Whether it is below its limit in every output."""
        return self.share <= self.limit


def not_measured(integration: Integration) -> IntegrationError:
    """Of an integration that was asked for without a check."""
    return IntegrationError({}, {}, math.nan, described(integration), of="stroke", limit=LARGEST)


def described(integration: Integration) -> str:
    """In words, for a record."""
    if integration.tolerance is not None:
        return f"error-controlled steps, tolerance {float(integration.tolerance):g}"
    return "one step a sample" if integration.substeps == 1 else f"{integration.substeps} steps a sample"


def with_tolerance(value: float) -> Integration:
    """Error-controlled steps."""
    return Integration(tolerance=jnp.asarray(value, dtype=float))


def _double() -> bool:
    return bool(jax.config.read("jax_enable_x64"))


def coarse_to_fine(system: System, reverse: bool = False) -> Iterator[Integration]:
    """From the cheapest to the finest of many runs; `reverse`: derivatives are found backwards through them."""
    yield ONE_STEP
    if isinstance(system.load, AbstractMovingLoad) and not reverse:
        yield from map(with_tolerance, TOLERANCES if _double() else TOLERANCES_SINGLE)
    else:
        yield from (Integration(substeps=number) for number in SUBSTEPS[1:])


def alone(system: System) -> Iterator[Integration]:
    """The same of one run by itself, of which one program is compiled."""
    if not isinstance(system.load, AbstractMovingLoad):
        return coarse_to_fine(system)
    return map(with_tolerance, ALONE if _double() else TOLERANCES_SINGLE)


def finest(system: System) -> Integration:
    """What the others are measured against."""
    if isinstance(system.load, AbstractMovingLoad):
        return with_tolerance(FINEST if _double() else FINEST_SINGLE)
    return Integration(substeps=MOST_SUBSTEPS)


def _references(system: System, tolerance: float | Literal["auto"], switches: bool) -> tuple[Integration, ...]:
    """The same whether a tolerance was asked for or found, so that one trajectory has one error; finer where it was finer than any found.

    switches: a small difference may grow, as in a loop whose controller switches. Two such runs then agree by chance, and two references are taken.
    """
    if not (_double() and isinstance(system.load, AbstractMovingLoad)):
        return (finest(system),)
    share = 1.0 if tolerance == AUTO else min(1.0, tolerance / TOLERANCES[-1])
    return tuple(with_tolerance(share * one) for one in (FINE, FINE_AGAIN)[: 1 + switches])


def reference(system: System) -> Integration:
    """What the others are measured against in a simulation."""
    return _references(system, AUTO, switches=False)[0]


def whole_transformation(system: System) -> dict[str, float]:
    """How far outputs move in a whole transformation, SI: what their errors are compared with. No other output decides."""
    wire, load = system.wire, system.load
    # A wire that barely transforms still stretches.
    strain, law = max(float(wire.constitutive.recoverable_strain), LEAST_STRAIN), wire.kinetics
    ways = {"martensite_fraction": 1.0}
    if isinstance(load, AbstractMovingLoad):
        width = abs(float(law.austenite_finish) - float(law.martensite_finish))
        start = jnp.asarray(load.start())
        stroke = float(load.travel(wire, strain))
        reading = float(load.sensed(start + stroke) - load.sensed(start))
        ways |= {"temperature": max(width, 1.0), "position": stroke, "reading": reading}
    elif isinstance(load, Coupon):
        ways |= {"strain": strain, "reading": strain}
    else:
        stress = strain * float(wire.constitutive.young_modulus_austenite)
        ways |= {"stress": stress, "reading": stress}
    return ways


def measured(
    outputs: Outputs, exact: Outputs, ways: Mapping[str, float], integration: Integration, limit: float = LARGEST
) -> IntegrationError:
    """The error of `outputs`, those of `integration`, against `exact` ones; `ways` of those that decide (SI)."""
    rms, largest, share = {}, {}, 0.0
    for name, values in outputs.items():
        runs = len(values)
        ours, theirs = np.reshape(values, (runs, -1)), np.reshape(exact[name], (runs, -1))
        with np.errstate(invalid="ignore"):
            same = (ours == theirs) | (np.isnan(ours) & np.isnan(theirs))
            difference = np.where(same, 0.0, np.abs(ours - theirs))
        difference = np.where(np.isnan(difference), np.inf, difference)
        rms[name] = float(np.sqrt((difference**2).mean(axis=1)).max())
        largest[name] = float(difference.max())
        if name in ways:
            share = max(share, rms[name] / ways[name])
    return IntegrationError(rms, largest, share, described(integration), of="stroke", limit=limit)


def _worst(errors: Sequence[IntegrationError], against: str) -> IntegrationError:
    """The larger one of errors of the same outputs, each by itself; nan where one is."""
    rms, largest = (
        {name: float(np.max([getattr(one, kind)[name] for one in errors])) for name in errors[0].rms}
        for kind in ("rms", "largest")
    )
    return replace(
        errors[0], rms=rms, largest=largest, share=float(np.max([one.share for one in errors])), against=against
    )


def integrated(
    run: Callable[[Integration], tuple[Result, Outputs]],
    system: System,
    tolerance: Tolerance,
    choices: Iterator[Integration],
    ways: Mapping[str, float] | None = None,
    limit: float = LARGEST,
    switches: bool = False,
) -> tuple[Integration, IntegrationError, Result]:
    """(integration, its error, what it gave) as `tolerance` asks: a number is taken, and None (one step a sample) is not measured.

    Under "auto" it is the first of `choices` whose error is small (`limit`, a share of `ways`, by default those of `whole_transformation`), or
    the first of less than twice the least error where none is. Where friction lets a load jump, or a controller switches, no step length
    settles at which sample it does. switches: the error is the larger one against two finer integrations.
    """
    if tolerance is None:
        return ONE_STEP, not_measured(ONE_STEP), run(ONE_STEP)[0]
    ways, references = ways or whole_transformation(system), _references(system, tolerance, switches)
    exact = [run(one)[1] for one in references]
    against = described(references[0]) + "".join(
        f" and {float(jnp.asarray(one.tolerance)):g}" for one in references[1:]
    )
    tried: list[tuple[Integration, IntegrationError, Result]] = []
    for choice in choices if tolerance == AUTO else iter([with_tolerance(tolerance)]):
        result, outputs = run(choice)
        error = _worst([measured(outputs, one, ways, choice, limit) for one in exact], against)
        tried.append((choice, error, result))
        if tried[-1][1].small:
            return tried[-1]
    least = min(one.share for _, one, _ in tried)
    return next(one for one in tried if one[1].share <= 2.0 * least)
