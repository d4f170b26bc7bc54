"""Which of two parameters is the lower one: transformation temperatures, and the stops of a load."""

from __future__ import annotations

import equinox as eqx
import jax
import numpy as np

from smajax.core.parameters import get_parameters, parameters

# (lower, higher, what that says): the names of parameters.
RANGES = (
    ("austenite_start", "austenite_finish", "on heating the wire starts to transform at A_s and has finished at A_f"),
    ("martensite_finish", "martensite_start", "on cooling the wire starts to transform at M_s and has finished at M_f"),
)
ORDER = (*RANGES, ("lower_stop", "upper_stop", "the load moves between its two end stops"))


def disorder(model: eqx.Module) -> tuple[str, str, str] | None:
    """(lower, higher, what is wrong) of the first pair in the wrong order; None where all is well or not known yet."""
    table = parameters(model)
    for lower, higher, why in ORDER:
        if lower not in table or higher not in table:
            continue
        pair = get_parameters(model, [lower, higher])
        if isinstance(pair, jax.core.Tracer):
            continue
        low, high = np.asarray(pair)
        if np.any(low >= high):
            unit = table[lower].unit
            at = f"`{lower}` = {np.ravel(low)[0]:g} {unit} is not below `{higher}` = {np.ravel(high)[0]:g} {unit}"
            return lower, higher, f"{at}; {why}: exchange or correct the two"
    return None


def check_order(model: eqx.Module) -> None:
    """ValueError where a transformation would finish before it starts, or a load ends before it begins."""
    pair = disorder(model)
    if pair is not None:
        raise ValueError(f"{pair[2]}.")
