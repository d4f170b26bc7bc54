"""The cases: which rig, which effects, how strong, which seed. All else follows from a case's name.

Nulls lack nothing; singles hold one effect of `effects.EFFECTS`, pairs two, triples three, foreign ones one that is in no library.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from studies.attribution_benchmark.effects import EFFECTS, absorbed, applies
from studies.attribution_benchmark.parameters import Wire
from studies.attribution_benchmark.rigs import RIGS, Rig, show
from studies.attribution_benchmark.sheet import drawn_about, on_the_sheet
from studies.attribution_benchmark.strength import NO_SUCH_WIRE, Found, Ruler

STRENGTHS = (1.0, 3.0, 10.0)  # noises, after a refit
NULLS = 30  # a rig
ANEW = 100  # of a case's number: by so much cases that are drawn anew differ
LARGEST_CHANGE = 0.25  # of a base parameter
LARGEST_SHIFT, LARGEST_WIDTH = 5.0, 0.25  # K of a range; of its width
LARGEST_SLOPE = 0.1  # of C_A, C_M
ANY_SIZE = "any"  # in the name of a case whose coefficients are drawn
ABSORBED_SHARE = 0.3  # of the largest coefficient
# Pairs of different kinds that a bench may well hold at once.
PAIRS = (
    ("latent_heat", "coulomb_friction"),
    ("latent_heat", "phase_resistance"),
    ("latent_heat", "smooth_transformation"),
    ("rising_convection", "sensor_lag"),
    ("rising_convection", "thermal_expansion"),
    ("ambient_drift", "minor_loops"),
    ("draught", "creep"),
    ("phase_resistance", "two_part_transformation"),
    ("temperature_resistance", "sensor_drift"),
    ("lead_resistance", "coulomb_friction"),
    ("smooth_transformation", "quantisation"),
    ("asymmetric_transformation", "residual_strain"),
)
COUPON_PAIRS = (
    ("smooth_transformation", "thermal_expansion"),
    ("asymmetric_transformation", "minor_loops"),
    ("stress_dependent_strain", "dead_band"),
)
# What a bench of somebody else may differ by: three effects of three equations.
TRIPLES = (
    ("free_convection", "coulomb_friction", "elastic_mismatch"),
    ("latent_heat", "asymmetric_transformation", "sensor_lag"),
    ("radiation", "minor_loops", "series_compliance"),
    ("temperature_resistance", "stress_dependent_width", "creep"),
)
COUPON_TRIPLES = (("asymmetric_transformation", "elastic_mismatch", "creep"),)


@dataclass(frozen=True)
class Case:
    """One case; `strength` 0: a null, or effects that a refit takes up. `sized`: whether coefficients are sought that have the strength, or else drawn in their ranges."""

    rig: str
    effects: tuple[str, ...]
    strength: float
    number: int
    sized: bool = True

    @property
    def name(self) -> str:
        """Names its folder and seeds its random numbers."""
        what = "+".join(self.effects) or "null"
        return f"{self.rig}-{what}-{f'{self.strength:g}' if self.sized else ANY_SIZE}-{self.number:02d}"

    @property
    def kind(self) -> str:
        """null, absorbed, single, pair, triple or outside."""
        if self.effects and not self.strength:
            return "absorbed"
        if any(EFFECTS[name].outside for name in self.effects):
            return "outside"
        return ("null", "single", "pair", "triple")[len(self.effects)]

    @property
    def fresh(self) -> bool:
        """Whether it is drawn anew: the values of the sheet are then only as true as their widths say."""
        return self.number >= ANEW

    @property
    def seed(self) -> int:
        """The same on every machine."""
        return zlib.crc32(self.name.encode())


@dataclass(frozen=True)
class Truth:
    """What is true of a case: its wire, the coefficients of its effects and the strengths they were found to have."""

    rig_name: str
    wire: Wire
    effects: dict[str, float]
    found: dict[str, Found]
    together: float  # strength of all effects at once

    @property
    def rig(self) -> Rig:
        """The rig."""
        return RIGS[self.rig_name]


def cases(drawn: int = 0, further: Sequence[float] = ()) -> list[Case]:
    """All cases, in a fixed order. drawn: 1, 2, ... for the same ones with other wires, strengths and noise, not seen in development.

    further: strengths at which every single effect comes once more, last.
    """
    found = [Case(rig, (), 0.0, i) for rig in RIGS for i in range(NULLS)]
    for name in EFFECTS:
        for rig in (rig for rig in RIGS if applies(name, rig)):
            if absorbed(name, rig):
                found.append(Case(rig, (name,), 0.0, 0))
                continue
            found += [Case(rig, (name,), strength, i) for i, strength in enumerate(STRENGTHS)]
    for loaded, coupon in ((PAIRS, COUPON_PAIRS), (TRIPLES, COUPON_TRIPLES)):
        for rig in RIGS:
            for several in coupon if rig == "coupon" else loaded:
                if all(applies(name, rig) and not absorbed(name, rig) for name in several):
                    found += [Case(rig, several, strength, i) for i, strength in enumerate(STRENGTHS[1:])]
    single = [case for case in found if case.kind in ("single", "outside") and case.strength == STRENGTHS[0]]
    found += [replace(case, strength=strength) for strength in further for case in single]
    return [replace(case, number=case.number + ANEW * drawn) for case in found]


def of_any_size(every: Sequence[Case]) -> list[Case]:
    """Every combination of rig and effects once, with coefficients that are drawn; nulls as they are. Seconds a case, where one of a strength takes minutes."""
    largest = [case for case in every if case.strength in (0.0, STRENGTHS[-1])]
    return [replace(case, sized=not case.strength) for case in largest if case.kind != "absorbed"]


def _drawn(case: Case, rig: Rig, wire: Wire) -> dict[str, float]:
    """Coefficients of the effects, the first that are drawn of which there is such a wire."""
    random = np.random.default_rng([case.seed, 3])
    while True:
        effects = {name: _drawn_coefficient(name, random) for name in case.effects}
        try:
            for run in rig.runs(wire):
                show(rig, wire, run, effects)
        except NO_SUCH_WIRE:
            continue
        return effects


def _drawn_coefficient(name: str, random: np.random.Generator) -> float:
    """Evenly in its logarithm, from where a search for a strength begins to the largest."""
    effect = EFFECTS[name]
    share = random.uniform(np.log(effect.first / effect.largest), 0.0)
    return float(effect.largest * np.exp(share))


def true_wire(case: Case) -> Wire:
    """The rig's wire with every unknown off its nominal value, and of a fresh case the values of the sheet too."""
    rig, random = RIGS[case.rig], np.random.default_rng([case.seed, 0])
    w = rig.wire
    changed: dict[str, float] = {}
    for name in rig.unknowns:
        if not name.endswith(("start", "finish")):
            most = LARGEST_SLOPE if name.startswith("stress_slope") else LARGEST_CHANGE
            changed[name] = getattr(w, name) * (1 + random.uniform(-most, most))
    for low, high in (("austenite_start", "austenite_finish"), ("martensite_finish", "martensite_start")):
        shift, width = random.uniform(-LARGEST_SHIFT, LARGEST_SHIFT), 1 + random.uniform(-LARGEST_WIDTH, LARGEST_WIDTH)
        middle, half = (
            (getattr(w, low) + getattr(w, high)) / 2 + shift,
            (getattr(w, high) - getattr(w, low)) / 2 * width,
        )
        changed[low], changed[high] = middle - half, middle + half
    wire = replace(w, **changed)  # type: ignore[arg-type]
    return drawn_about(rig, wire, case.seed) if case.fresh else wire


def truth(case: Case) -> Truth:
    """Wire and coefficients of a case; a strength takes minutes per effect on a rig with a load. Of coefficients that are drawn it is not known (NaN)."""
    rig, wire = RIGS[case.rig], true_wire(case)
    if not case.effects:
        return Truth(case.rig, wire, {}, {}, 0.0)
    if case.kind == "absorbed":
        effects = {name: ABSORBED_SHARE * EFFECTS[name].largest for name in case.effects}
        return Truth(case.rig, wire, effects, {name: Found(c, 0.0, False) for name, c in effects.items()}, 0.0)
    if not case.sized:
        effects = _drawn(case, rig, wire)
        return Truth(case.rig, wire, effects, {name: Found(c, np.nan, False) for name, c in effects.items()}, np.nan)
    ruler = Ruler(rig, wire, on_the_sheet(rig) if case.fresh else {})
    found = {name: ruler.find(name, case.strength) for name in case.effects}
    effects = {name: f.coefficient for name, f in found.items()}
    alone = len(found) == 1
    together = next(iter(found.values())).strength if alone else ruler.together(effects)
    return Truth(case.rig, wire, effects, found, together)
