"""Priors of the effects' coefficients: each has a width with a source, and an extent turns it into the coefficient's unit."""

from __future__ import annotations

import math
from typing import Any

import jax.numpy as jnp
import pytest

from smajax.core.parameters import parameters
from smajax.model.effects.candidate import PRIOR_ODDS, Candidate, Extent, Width
from smajax.model.effects.library import LIBRARY, of_others
from smajax.model.effects.prior_width import CoefficientPrior, unit_of_width, width_of
from smajax.model.load.force import force_at_rest
from smajax.model.presets import build

# A usual bench, as the initial guesses have it: runs of 20 s, a stroke of 20 mm read in steps of 1 mm, 100 g.
EXTENT = Extent(seconds=20.0, stroke=0.02, increment=1e-3, lowest=-1e-3, highest=0.019)
FORCE = 0.98  # N
OWN = {name: effect for name, effect in LIBRARY.items() if name not in of_others()}
COEFFICIENTS = [(name, one.split(".")[1]) for name, effect in OWN.items() for one in parameters(effect.base())]


def _log_distance(value: float, base: float) -> float:
    return math.inf if value <= 0.0 else abs(math.log(value / base))


@pytest.mark.parametrize(("effect", "coefficient"), COEFFICIENTS)
def test_a_coefficient_has_a_width_with_a_source(effect: str, coefficient: str) -> None:
    candidate = OWN[effect].candidate
    width = candidate.widths[coefficient]
    assert 0.0 < width.sigma < math.inf
    assert len(width.source) >= 15, "say where the number comes from, or why it is that"
    if coefficient in candidate.switches:
        assert (width.logarithmic, width.base) == (False, None), "a switch is centred on its base value, zero"
    elif width.of and width.base is None:
        assert candidate.initial_guess[coefficient] == 0.0, "give the base of a scaled width in that scale too"


@pytest.mark.parametrize(("effect", "coefficient"), COEFFICIENTS)
def test_a_prior_lies_within_the_bounds_and_reaches_the_initial_guess(effect: str, coefficient: str) -> None:
    prior = width_of(OWN[effect], coefficient, None, EXTENT, FORCE)
    entry = parameters(OWN[effect].base())[f"{effect}.{coefficient}"]
    low, high = OWN[effect].candidate.bounds(EXTENT).get(coefficient, (entry.low, entry.high))
    guess = OWN[effect].candidate.initial_guess[coefficient]
    assert low <= prior.base <= high
    if prior.logarithmic:
        assert low > 0.0
        assert prior.sigma <= 0.5 * math.log(high / low)
        assert _log_distance(guess, prior.base) <= 3.0 * prior.sigma
    else:
        assert prior.sigma <= 0.5 * (high - low)
        assert abs(guess - prior.base) <= 3.0 * prior.sigma


@pytest.mark.parametrize("effect", sorted(OWN))
def test_every_width_is_of_a_coefficient_and_every_class_has_odds(effect: str) -> None:
    own = {coefficient for name, coefficient in COEFFICIENTS if name == effect}
    assert OWN[effect].candidate.widths.keys() == own
    assert 0.0 < PRIOR_ODDS[OWN[effect].candidate.prior_class] < 1.0


def test_an_event_needs_more_evidence_than_a_bench_and_a_bench_more_than_a_material() -> None:
    classes = {name: effect.candidate.prior_class for name, effect in OWN.items()}
    assert PRIOR_ODDS["event"] < PRIOR_ODDS["bench"] < PRIOR_ODDS["material"]
    assert (classes["latent_heat"], classes["coulomb_friction"], classes["draught"]) == ("material", "bench", "event")
    assert {name for name, one in classes.items() if one == "event"} == {
        "ambient_drift",
        "draught",
        "input_clock",
        "input_level",
        "load_shift",
        "loose_start",
        "sensor_drift",
    }


@pytest.mark.parametrize(
    ("effect", "coefficient", "expected"),
    [
        ("latent_heat", "enthalpy", CoefficientPrior(0.0, 2e4, False)),  # by itself
        ("sensor_offset", "shift", CoefficientPrior(0.0, 0.01 * 0.02, False)),  # of the stroke
        # Of the increment, and half of its bounds.
        ("sensor_resolution", "increment", CoefficientPrior(1e-3, 0.01242252, True)),
        ("draught", "time", CoefficientPrior(10.0, 10.0, False)),  # of a run
        ("ambient_drift", "rate", CoefficientPrior(0.0, 2.0 / 20.0, False)),  # one over a run
        ("sensor_drift", "rate", CoefficientPrior(0.0, 0.01 * 0.02 / 20.0, False)),  # the stroke over a run
        ("sensor_limit", "upper", CoefficientPrior(0.019, 1e-3, False)),  # of the stroke, about the highest reading
        ("coulomb_friction", "limit", CoefficientPrior(0.0, 0.098, False)),  # of the load at rest
        ("stress_dependent_strain", "scale", CoefficientPrior(1e8, 0.7, True)),  # no switch: about its initial guess
    ],
)
def test_a_width_is_in_the_unit_of_its_coefficient(effect: str, coefficient: str, expected: CoefficientPrior) -> None:
    assert width_of(OWN[effect], coefficient, None, EXTENT, FORCE) == pytest.approx(expected)


def test_a_width_is_at_most_half_of_the_bounds_of_the_fit() -> None:
    assert width_of(OWN["latent_heat"], "enthalpy", (0.0, 1e4), EXTENT).sigma == 5e3
    narrow = width_of(OWN["creep"], "time_constant", (4.0, 9.0), EXTENT)
    assert narrow == pytest.approx(CoefficientPrior(5.0, math.log(1.5), True))
    moved = width_of(OWN["creep"], "time_constant", (8.0, 9.0), EXTENT)
    assert moved.base == 8.0


def test_a_scale_that_the_runs_do_not_have_leaves_the_width_of_an_unlisted_coefficient() -> None:
    assert width_of(OWN["coulomb_friction"], "limit", None, EXTENT, 0.0).sigma == pytest.approx(0.2)  # twice 0.1 N
    smooth = EXTENT._replace(increment=0.0)
    assert width_of(OWN["sensor_resolution"], "increment", None, smooth) == pytest.approx((1e-3, 1.0, True))


def _stripped(effect: str, **changed: Any) -> Any:
    own: Any = OWN[effect]
    candidate = Candidate(
        title=own.candidate.title,
        equation=own.candidate.equation,
        formula=own.candidate.formula,
        sentence=own.candidate.sentence,
        switches=own.candidate.switches,
        initial_guess=own.candidate.initial_guess,
        **changed,
    )
    return type(own)(own.__name__, (own,), {"candidate": candidate, "__module__": __name__})


@pytest.mark.parametrize(
    ("effect", "coefficient", "expected"),
    [
        ("radiation", "emissivity", CoefficientPrior(0.0, 0.5, False)),  # twice 0.3, within half of 0 to 1
        ("phase_resistance", "contrast", CoefficientPrior(0.0, 0.2, False)),  # the initial guess is negative
        ("creep", "time_constant", CoefficientPrior(5.0, 1.0, True)),  # positive
        ("minor_loops", "pinned", CoefficientPrior(0.5, 0.25, False)),  # a quarter of the bounds
    ],
)
def test_an_effect_without_declared_widths_has_default_ones(
    effect: str, coefficient: str, expected: CoefficientPrior
) -> None:
    bare = _stripped(effect)
    assert (bare.candidate.prior_class, bare.candidate.widths) == ("bench", {})
    assert width_of(bare, coefficient, None, EXTENT) == pytest.approx(expected)


def test_an_unknown_coefficient_is_an_error_with_close_matches() -> None:
    with pytest.raises(ValueError, match="`latent_heat` has no coefficient `entalpy`; did you mean 'enthalpy'"):
        width_of(OWN["latent_heat"], "entalpy", None, EXTENT)


@pytest.mark.parametrize(
    ("unit", "width", "expected"),
    [
        ("J/kg", Width(1.0, ""), "J/kg"),
        ("m", Width(1.0, "", of="stroke"), "of the stroke"),
        ("K/s", Width(1.0, "", of="1/run"), "K per run"),
        ("m/s", Width(1.0, "", of="stroke/run"), "of the stroke per run"),
        ("s", Width(1.0, "", of="run", logarithmic=True), "of a run's length"),
        ("m", Width(1.0, "", of="stroke", above="highest"), "of the stroke above the highest reading"),
    ],
)
def test_a_width_is_shown_in_its_own_unit(unit: str, width: Width, expected: str) -> None:
    assert unit_of_width(unit, width) == expected


@pytest.mark.parametrize(
    ("load", "inputs", "expected"),
    [("dead_weight", {"mass": 0.1}, 0.981), ("dead_weight", {}, 0.075 * 9.81), ("bias_spring", {}, None)],
)
def test_the_force_at_rest_is_that_of_the_load_at_its_start(
    load: str, inputs: dict[str, float], expected: float | None
) -> None:
    system = build("flexinol_ht_500um" if load == "bias_spring" else "flexinol_table_3_2", load, "voltage")
    wanted = float(system.load.spring_preload) if expected is None else expected
    assert float(force_at_rest(system.load, {name: jnp.asarray(one) for name, one in inputs.items()})) == pytest.approx(
        wanted
    )
