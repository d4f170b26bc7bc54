"""What the experiment file does not give is not known: priors of the values that a model has from its preset alone.

A fit may correct them within what data sheets and tables leave open; what the file lists is held.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from smajax.core.parameters import Parameter
from smajax.data.experiment.record import FromModelFile, PriorSpread
from smajax.fit.sensitivity import Sensitivity
from smajax.model.effects.prior_width import CoefficientPrior

WIDTHS = 3.0  # of its prior that a fit may move a value of a preset
VISIBLE = 1.0  # noises, over all samples

# Relative widths (of the natural logarithm), and where they come from.
RELATIVE: Mapping[str, tuple[float, str]] = {
    "young_modulus_austenite": (0.2, "NiTi data sheets: 70 to 83 GPa, and 40 to 90 GPa measured"),
    "young_modulus_martensite": (0.25, "NiTi data sheets: 28 to 41 GPa, and 20 to 50 GPa measured"),
    "stress_slope_austenite": (0.2, "NiTi: 5 to 8 MPa/K by Clausius-Clapeyron, Elahinia 2004 has 6.89 and 10.3"),
    "stress_slope_martensite": (0.2, "NiTi: 5 to 8 MPa/K by Clausius-Clapeyron, Elahinia 2004 has 6.89 and 10.3"),
    "thermal_modulus": (
        1.1,
        "Elahinia 2004, Table 3.1: +0.55 MPa/K, a wire that shrinks when heated; expansions of NiTi, 6.6e-6 to 11e-6 1/K, give -0.2 to -0.8 MPa/K",
    ),
    "resistivity_austenite": (0.1, "wire data sheets: ohms per metre to 10 %"),
    "resistivity_martensite": (0.1, "wire data sheets: ohms per metre to 10 %"),
    "damping": (
        2.0,
        "no sheet gives it; the presets' is chosen so that nothing rings, and a bearing has a hundredth of it",
    ),
    "inertia_ratio": (
        0.2,
        "hub, pulley and cable, which the masses of payload and link do not have: a fifth of their inertia",
    ),
}
# The sign may be the other one: a normal prior, as wide as a share of the value.
SIGNED = frozenset({"thermal_modulus"})


def preset_priors(
    table: Mapping[str, Parameter],
    values: Mapping[str, float],
    given: frozenset[str],
    declared: Mapping[str, PriorSpread] = MappingProxyType({}),
) -> dict[str, CoefficientPrior]:
    """Priors about the preset's `values` (SI) of the parameters in `table` that are not among those `given`.

    `given`: known from the experiment file or the runs, or unknowns of the fit. `declared`: how uncertain they are by the experiment file, of
    parameters that `RELATIVE` does not have too. Those of `RELATIVE` are logarithmic; of `SIGNED` ones, and of a value below zero, which has no logarithm, normal. A
    value of zero is held.
    """
    found = {
        name: _relative(name, float(values[name]), sigma)
        for name, (sigma, _) in RELATIVE.items()
        if name in table and name not in given and values[name] != 0.0
    }
    for name, one in declared.items():
        if one.sigma is not None:
            base = float(values[name]) if one.base is None else one.base
            found[name] = CoefficientPrior(base, one.sigma, one.logarithmic)
    return found


def _relative(name: str, value: float, sigma: float) -> CoefficientPrior:
    if name in SIGNED or value < 0.0:
        return CoefficientPrior(value, sigma * abs(value), False)
    return CoefficientPrior(value, sigma, True)


def fitted_priors(kept: FromModelFile, given: frozenset[str]) -> dict[str, CoefficientPrior]:
    """Priors of what was fitted before and is not among those `given`: normal ones about those values (SI), by their standard errors.

    What no run determined has the prior that it had, else the width of `RELATIVE`, else that of a uniform distribution over its bounds.
    """
    found = {
        name: CoefficientPrior(float(kept.values[name]), error, False)
        for name, error in kept.errors.items()
        if name not in given
    }
    for name in kept.undetermined:
        if name in given:
            continue
        value, (low, high), own = float(kept.values[name]), kept.bounds[name], kept.priors.get(name)
        if own is not None:
            found[name] = CoefficientPrior(own.mean, own.sigma, own.logarithmic)
        elif name in RELATIVE and value != 0.0:
            found[name] = _relative(name, value, RELATIVE[name][0])
        else:
            found[name] = CoefficientPrior(value, (high - low) / math.sqrt(12.0), False)
    return found


def preset_bounds(
    presets: Mapping[str, CoefficientPrior], bounds: Mapping[str, tuple[float, float]]
) -> dict[str, tuple[float, float]]:
    """Within so many widths: a value at zero has no logarithm, and a fit does not leave it again."""
    found = {}
    for name, prior in presets.items():
        low, high = bounds[name]
        if prior.logarithmic:
            factor = math.exp(WIDTHS * prior.sigma)
            found[name] = max(low, prior.base / factor), min(high, prior.base * factor)
        else:
            reach = WIDTHS * prior.sigma
            found[name] = max(low, prior.base - reach), min(high, prior.base + reach)
    return found


def visible(
    at: Sensitivity, values: Mapping[str, float], presets: Mapping[str, CoefficientPrior]
) -> dict[str, CoefficientPrior]:
    """Those of `presets` of which one width changes the runs by more than the noise, by the Jacobian at the base fit."""

    def width(name: str, prior: CoefficientPrior) -> float:
        return prior.sigma * values[name] if prior.logarithmic else prior.sigma

    return {
        name: one for name, one in presets.items() if np.linalg.norm(at.columns([name])) * width(name, one) > VISIBLE
    }
