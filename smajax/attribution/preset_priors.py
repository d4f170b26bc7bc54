"""What the experiment file does not give is not known: priors of the values that a model has from its preset alone.

A fit may correct them within what data sheets and tables leave open; what the file lists is held.
"""

from __future__ import annotations

from collections.abc import Mapping

from smajax.core.parameters import Parameter
from smajax.model.effects.prior_width import CoefficientPrior

# Relative widths (of the natural logarithm), and where they come from.
RELATIVE: Mapping[str, tuple[float, str]] = {
    "young_modulus_austenite": (0.2, "NiTi data sheets: 70 to 83 GPa, and 40 to 90 GPa measured"),
    "young_modulus_martensite": (0.25, "NiTi data sheets: 28 to 41 GPa, and 20 to 50 GPa measured"),
    "stress_slope_austenite": (0.2, "NiTi: 5 to 8 MPa/K by Clausius-Clapeyron, Elahinia 2004 has 6.89 and 10.3"),
    "stress_slope_martensite": (0.2, "NiTi: 5 to 8 MPa/K by Clausius-Clapeyron, Elahinia 2004 has 6.89 and 10.3"),
    "thermal_modulus": (0.7, "Elahinia 2004, Table 3.1: 0.55 MPa/K, from expansions that differ by a factor of two"),
    "resistivity_austenite": (0.1, "wire data sheets: ohms per metre to 10 %"),
    "resistivity_martensite": (0.1, "wire data sheets: ohms per metre to 10 %"),
    "damping": (1.0, "no sheet gives it"),
}


def preset_priors(
    table: Mapping[str, Parameter], values: Mapping[str, float], given: frozenset[str]
) -> dict[str, CoefficientPrior]:
    """Logarithmic priors about the preset's `values` (SI) of the parameters in `table` that are not among those `given`.

    `given`: known from the experiment file or the runs, or unknowns of the fit. A value of zero has no logarithm and is held.
    """
    return {
        name: CoefficientPrior(float(values[name]), sigma, True)
        for name, (sigma, _) in RELATIVE.items()
        if name in table and name not in given and values[name] > 0.0
    }
