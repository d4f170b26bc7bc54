"""Evidence in closed form: against integration by quadrature, and Laplace's against the linear model's."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest
from scipy import integrate

from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.laplace_evidence import FittedModel, fitted_model
from smajax.attribution.subset_evidence import LinearModel
from smajax.attribution.traces import Variant
from smajax.core.parameters import parameter_values, parameters
from smajax.fit.preset_priors import RELATIVE, preset_bounds, preset_priors
from smajax.model.presets import LOADS, WIRES, build
from tests.helpers.hot_weight import NOISE, hot_weight
from tests.helpers.often import often

A, B = Variant("latent_heat", -1), Variant("rising_convection", -1)


def _linear(one_sided: bool, sizes: tuple[float, float], seed: int = 0) -> tuple[LinearModel, np.ndarray, np.ndarray]:
    """Two effects of one coefficient each, no unknowns, noise of one; columns (n, 2) and outputs (n,)."""
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((30, 2)) * 0.4
    outputs = columns @ np.asarray(sizes) + rng.standard_normal(30)
    search = hot_weight({})
    return (
        LinearModel(
            traces=None,  # type: ignore[arg-type]  # neither traces nor parameters are read for the evidence
            joint=search.joint,
            unknowns=[],
            places={A: [0], B: [1]},
            names=["a", "b"],
            scales=np.ones(2),
            gram=columns.T @ columns,
            right=columns.T @ outputs,
            precision=np.ones(2),
            one_sided=np.asarray([one_sided, False]),
            log_odds={A: np.log(0.1), B: np.log(0.03)},
            squares=float(outputs @ outputs),
            variance=1.0,
        ),
        columns,
        outputs,
    )


@pytest.mark.parametrize(
    ("sizes", "one_sided"),
    often(
        itertools.product([(0.0, 0.0), (1.5, -1.0), (-0.5, 0.7)], [False, True]),
        [((0.0, 0.0), True), ((1.5, -1.0), False), ((-0.5, 0.7), True)],
    ),
)
def test_the_evidence_of_a_set_is_the_integral_over_its_parameters(one_sided: bool, sizes: tuple[float, float]) -> None:
    linear, columns, outputs = _linear(one_sided, sizes)

    def normal(x: float) -> float:
        return math.exp(-0.5 * x**2) / math.sqrt(2.0 * math.pi)

    def density(a: float, b: float) -> float:
        prior = normal(a) * normal(b) * (2.0 * (a >= 0.0) if one_sided else 1.0)
        return float(prior * np.exp(-0.5 * np.sum((outputs - columns @ [a, b]) ** 2) + 0.5 * np.sum(outputs**2)))

    both = integrate.dblquad(density, -6.0, 6.0, 0.0 if one_sided else -6.0, 6.0, epsabs=1e-10)[0]
    first = integrate.quad(lambda a: density(a, 0.0) / normal(0.0), 0.0 if one_sided else -6.0, 6.0)[0]
    none = linear.log_evidence(frozenset())
    assert linear.log_evidence(frozenset({A})) - none == pytest.approx(np.log(first) + np.log(0.1), abs=1e-5)
    # With two coefficients the half-normal one is taken by its own margin.
    tolerance = 1e-5 if not one_sided else 0.05
    assert linear.log_evidence(frozenset({A, B})) - none == pytest.approx(np.log(both) + np.log(0.003), abs=tolerance)


def test_the_search_over_sets_ends_at_the_best_of_all() -> None:
    for seed in range(10):
        linear, _, _ = _linear(False, (1.5, -1.0), seed)
        sets = [frozenset(), frozenset({A}), frozenset({B}), frozenset({A, B})]
        best = max(sets, key=linear.log_evidence)
        assert linear.climb(frozenset()) == best
        assert linear.climb(frozenset({A, B})) == best


def test_a_set_that_is_singular_to_rounding_is_impossible_and_still_has_an_estimate() -> None:
    """It may be fitted whatever the linear model says, and a fit needs a start."""
    linear, _, _ = _linear(False, (1.0, 0.5))
    linear.gram = np.asarray([[1.0, 1.0 + 1e-9], [1.0 + 1e-9, 1.0]])
    linear.precision, linear.right = np.zeros(2), np.ones(2)
    both = frozenset({A, B})
    assert linear.log_evidence(both) == -np.inf
    assert sum(linear.estimate(both).coefficients.values()) == pytest.approx(1.0, rel=1e-3)


def test_laplaces_evidence_is_the_linear_models_where_the_model_is_linear() -> None:
    linear, columns, outputs = _linear(False, (1.5, -1.0))
    estimate = np.linalg.solve(columns.T @ columns + np.eye(2), columns.T @ outputs)
    residual = outputs - columns @ estimate

    def model(
        effects: tuple[str, ...], gram: np.ndarray, values: np.ndarray, left: np.ndarray, odds: float
    ) -> FittedModel:
        prior = odds - 0.5 * float(values @ values)
        size = len(values)
        return FittedModel(
            effects=effects,
            values=values,
            names=tuple("ab"[:size]),
            scales=np.ones(size),
            squares=float(left @ left),
            gram=gram,
            precision=np.ones(size),
            width_factors={},
            log_prior=prior,
            one_sided=(),
            residual=left,
            rms=1.0,
            correlation=1.0,
        )

    both = model(("a", "b"), columns.T @ columns, estimate, residual, np.log(0.003))
    none = model((), np.zeros((0, 0)), np.zeros(0), outputs, 0.0)
    expected = linear.log_evidence(frozenset({A, B})) - linear.log_evidence(frozenset())
    assert both.log_evidence(1.0) - none.log_evidence(1.0) == pytest.approx(expected, abs=1e-9)
    np.testing.assert_allclose(
        list(both.standard_errors(1.0).values()), np.sqrt(np.diag(np.linalg.inv(columns.T @ columns + np.eye(2))))
    )


def test_a_model_whose_effects_are_off_is_the_base_model() -> None:
    joint: JointParameters = hot_weight({}).joint
    values = joint.problem.start_values() + 1.0
    base = joint.without(values, ())
    for names in joint.coefficients.values():
        assert [base[joint.slots[name]] for name in names] == [joint.priors[name].base for name in names]
    assert base[joint.slots["convection_coefficient"]] == values[joint.slots["convection_coefficient"]]
    assert joint.scale("convection_coefficient", 100.0) == pytest.approx(350.0)
    assert joint.one_sided("latent_heat.enthalpy")
    assert not joint.one_sided("phase_resistance.contrast")
    assert NOISE > 0.0


def test_of_two_columns_that_are_one_to_rounding_the_covariance_has_no_negative_variance() -> None:
    """Their sum is known, each of them as little as before."""
    joint = hot_weight({}).joint
    model = fitted_model(joint, ("latent_heat",), joint.problem.start_values(), ("latent_heat",))
    column = np.asarray([1.0, 1.0, 1.0 + 1e-9])
    known = dataclasses.replace(model, gram=1e12 * np.outer(column, column), precision=np.full(3, 1e-6))
    covariance = known.covariance(1.0)
    assert (np.diag(covariance) > 0.0).all()
    assert np.isfinite(known.log_evidence(1.0))


def test_values_of_a_preset_are_free_within_their_widths_unless_the_file_gives_them() -> None:
    system = build("flexinol_table_3_2", "dead_weight", "voltage")
    table, values = parameters(system), parameter_values(system)
    free = preset_priors(table, values, frozenset({"damping"}))
    assert "young_modulus_martensite" in free
    assert "damping" not in free
    for name, prior in free.items():
        assert prior.base == values[name]
        assert prior.logarithmic == (name != "thermal_modulus")
        assert 0.0 < prior.deviation(1.2 * values[name]) < 2.0
    boxes = preset_bounds(free, {name: (table[name].low, table[name].high) for name in free})
    for name, (low, high) in boxes.items():
        assert table[name].low <= low < values[name] < high <= table[name].high
        assert low > 0.0 or name == "thermal_modulus"  # at zero there is no logarithm
    # Whichever sign the preset has, the wire may have the other one.
    for preset in ("flexinol_table_3_2", "flexinol_table_3_2_expanding"):
        own = parameter_values(build(preset, "dead_weight", "voltage"))["thermal_modulus"]
        prior = preset_priors(table, {**values, "thermal_modulus": own}, frozenset())["thermal_modulus"]
        assert prior.base == own
        assert prior.sigma == pytest.approx(1.1 * abs(own))
        assert not prior.logarithmic
        low, high = preset_bounds({"thermal_modulus": prior}, {"thermal_modulus": (-1e9, 1e9)})["thermal_modulus"]
        assert low < -0.8e6
        assert high > 0.55e6
    below_zero = preset_priors(table, {**values, "damping": -1.0}, frozenset())["damping"]
    assert not below_zero.logarithmic
    assert below_zero.sigma == pytest.approx(2.0)
    known = {name for wire in WIRES for load in LOADS for name in _names(wire, load)}
    assert set(RELATIVE) <= known
    assert all(source for _, source in RELATIVE.values())


def _names(wire: str, load: str) -> set[str]:
    drive = "none" if "coupon" in load else "voltage"
    try:
        return set(parameters(build(wire, load, drive)))
    except ValueError:
        return set()
