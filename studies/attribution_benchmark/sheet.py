"""What the maker's sheet and the bench's own measurements say of a wire, and how well: values that an experiment file gives with their widths.

They are no unknowns with wide bounds, as the ranges of transformation are, and not known exactly either.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from types import MappingProxyType

import numpy as np

from studies.attribution_benchmark.parameters import Wire
from studies.attribution_benchmark.rigs import Rig

# Standard deviation of the natural logarithm.
WIDTHS: Mapping[str, float] = MappingProxyType(
    {
        "young_modulus_austenite": 0.05,  # a tensile test of the lot: the grips and the cross-section
        "young_modulus_martensite": 0.05,
        "stress_slope_austenite": 0.05,  # three isobaric cycles of the lot
        "stress_slope_martensite": 0.05,
        "thermal_modulus": 0.1,  # a dilatometer's expansion times a modulus
        "resistivity_austenite": 0.03,  # an ohmmeter, and the length between its clips
        "resistivity_martensite": 0.03,
    }
)


def on_the_sheet(rig: Rig) -> dict[str, float]:
    """Widths of those values that are no unknowns of the rig; a coupon has no current."""
    passed = ("resistivity_austenite", "resistivity_martensite") if rig.load is None else ()
    return {name: one for name, one in WIDTHS.items() if name not in (*rig.unknowns, *passed)}


def drawn_about(rig: Rig, wire: Wire, seed: int) -> Wire:
    """`wire` with the values of the sheet as true as their widths say."""
    random = np.random.default_rng([seed, 2])
    names = on_the_sheet(rig)
    assert names.keys() <= {one.name for one in fields(Wire)}
    return replace(
        wire, **{name: getattr(wire, name) * float(np.exp(random.normal(0.0, one))) for name, one in names.items()}
    )
