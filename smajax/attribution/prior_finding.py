"""What the experiment file says of a prior, as a finding."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PriorFinding:
    """What the experiment file says of a prior, as it was used, and what stands in its place without it (None: nothing, the value is held).

    Of an effect, by its name, `odds` alone; of a coefficient ("latent_heat.enthalpy"), a value of a preset and an unknown the others, SI. `width` is of the
    natural logarithm where `logarithmic`.
    """

    name: str
    unit: str = ""
    odds: float | None = None
    base: float | None = None
    width: float | None = None
    logarithmic: bool = False
    library_odds: float | None = None
    library_base: float | None = None
    library_width: float | None = None
    library_logarithmic: bool = False
    of_unknown: bool = False  # of a value under [unknown], which without it has its box and no prior
