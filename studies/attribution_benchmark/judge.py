"""What a closed loop said of a case, held against what is true of it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from smajax.core.files import replace
from smajax.model.effects.library import LIBRARY
from studies.attribution_benchmark.effects import EFFECTS

# What the library calls the generator's effects, where it calls them otherwise. Neither was written with the other in
# view; some of the library's forms were widened after cases that it missed (README.md). The generator's smooth transformation, a share of the wire over a wider range, is the library's of two parts. The curve of the transformation has all their shapes.
CALLED: dict[str, tuple[str, ...]] = {
    "drive_dead_zone": ("dead_zone",),
    "drive_saturation": ("amplifier_saturation",),
    "supply_sag": ("supply_sag", "supply_memory"),
    "pwm": ("pwm_smoothing", "pulsed_voltage"),
    "stress_rate_share": ("enhanced_conditions", "liang_conditions"),
    "different_slopes": ("unequal_stress_slopes",),
    "smooth_transformation": (
        "smooth_transformation",
        "two_step_transformation",
        "two_part_transformation",
        "transformation_curve",
    ),
    "asymmetric_transformation": ("asymmetric_transformation", "transformation_curve"),
    "two_part_transformation": ("two_step_transformation", "two_part_transformation", "transformation_curve"),
    "rate_dependence": ("lagging_transformation",),
    "transformation_drift": ("drifting_temperatures",),
    "coulomb_friction": ("coulomb_friction", "pulley_friction"),
    "stribeck_friction": ("stribeck_friction", "pulley_stribeck_friction"),
    "slack": ("slack", "loose_start"),
    "dead_band": ("sensor_backlash",),
    "quantisation": ("sensor_resolution",),
    "input_gain": ("input_level",),
    # The same heat balance: h x + K (x - c), tau c' = x - c - c/2, is (h + K) (x - w l) of an l that follows x with 2/3 tau, w = 2/3 K/(h + K).
    "clamp_node": ("warmed_surroundings",),
}
EQUATIONS = ("heat", "electrical", "kinetics", "constitutive", "mechanics", "sensor", "input")
NOTHING, OUTSIDE = "nothing", "not in the library"
REACHED = 0.8  # of the strength asked for: a case that comes to less is counted where it comes to
CONFUSABLE = 0.05  # weight from which on a confounder counts as named


@dataclass(frozen=True)
class Judged:
    """One case beside its truth. Errors are rms over the noise."""

    case: str
    kind: str  # null, absorbed, single, pair, triple, outside
    rig: str
    asked: float  # noises that the effect leaves after a refit of the base model; NaN of drawn coefficients
    # What it came to: a physical limit may lie below. Of drawn coefficients what the loop's own refit leaves.
    strength: float
    truth: tuple[str, ...]  # as the generator calls them
    equations: tuple[str, ...]  # in which they are
    verdict: str
    added: tuple[str, ...]  # the strongest first
    named: tuple[str, ...]  # added, and what the report says could be mistaken for it
    where: tuple[str, ...]  # equations of what was added, and where an unknown term may live, the likeliest first
    fit_before: float
    fit_after: float
    held_out_before: float
    held_out_after: float
    seconds: float
    weakest: float = float("nan")  # strength of the weakest of its effects, each alone; NaN: not written down

    @property
    def full(self) -> bool:
        """Whether each of several effects has the strength that was asked for: a physical limit may lie below. Not where it is not known."""
        return self.weakest >= REACHED * self.asked

    @property
    def short(self) -> bool:
        """Whether one is known to have less."""
        return self.weakest < REACHED * self.asked

    @property
    def several(self) -> bool:
        """Whether more than one effect of the library is there."""
        return self.kind in ("pair", "triple")

    @property
    def effect_right(self) -> bool:
        """Every true effect is among those that are named."""
        return all(set(called(name)) & set(self.named) for name in self.truth)

    @property
    def equation_right(self) -> bool:
        """The strongest effect, or the unknown term, is in an equation that lacks something."""
        return bool(self.where) and self.where[0] in self.equations

    @property
    def told(self) -> str:
        """One of `EQUATIONS`, `NOTHING` or `OUTSIDE`: what the answer comes down to."""
        return self.where[0] if self.where else NOTHING if self.verdict == "adequate" else OUTSIDE

    @property
    def right(self) -> bool:
        """The answer that the case's kind asks for."""
        if self.kind in ("null", "absorbed"):
            return self.verdict == "adequate"
        if self.kind == "outside":
            if self.verdict == "explained":  # something of the library's is said to be all that there is
                return False
            # To name one place and a wrong one is no right answer, though "not in the library" is half of it.
            alike = not self.added and bool(set(self.where) & set(self.equations))
            return self.told in (*self.equations, OUTSIDE) or alike
        return self.effect_right


def called(name: str) -> tuple[str, ...]:
    """The library's names of an effect of the generator."""
    return CALLED.get(name, (name,))


def equation_of(group: str) -> str:
    """The library's word for the generator's."""
    return "input" if group == "command" else group


def _told_among(term: Mapping[str, Any], terms: Sequence[Mapping[str, Any]]) -> bool:
    """Whether an unknown term is the one named, or said to do alike."""
    return term["named"] or any(one["named"] and term["name"] in one["indistinguishable"] for one in terms)


def _error(runs: Sequence[Mapping[str, Any]], role: str, which: str, noise: float) -> float:
    own = [run for run in runs if (run["role"] == "fit") == (role == "fit")]
    squares = sum(run[f"rmse_{which}"] ** 2 * run["samples"] for run in own)
    return float((squares / max(sum(run["samples"] for run in own), 1)) ** 0.5 / noise)


def names_of(truth: Mapping[str, Any]) -> tuple[str, ...]:
    """The true effects, as the generator calls them."""
    return tuple(truth["effects"])


def equations_of(truth: Mapping[str, Any]) -> tuple[str, ...]:
    """The equations that lack them."""
    return tuple(equation_of(entry["group"]) for entry in truth["effects"].values())


def kind_of(truth: Mapping[str, Any]) -> str:
    """The kind of case: what the library does not hold is outside, whatever the generator thinks."""
    held = all(set(called(name)) & set(LIBRARY) for name in names_of(truth))
    # By the library of today, not by that of the day on which the case was written.
    foreign = not held or any(
        EFFECTS[name].outside if name in EFFECTS else entry["outside"] for name, entry in truth["effects"].items()
    )
    if truth["kind"] == "absorbed":
        return "absorbed"
    return "outside" if foreign else ("null", "single", "pair", "triple")[len(truth["effects"])]


def remaining(error: float) -> float:
    """What a refit with this error leaves beside the noise, both over the noise."""
    return math.sqrt(max(error**2 - 1.0, 0.0))


def asked_and_strength(truth: Mapping[str, Any], fit_before: float) -> tuple[float, float]:
    """The strength that was asked for and the one that it came to; of drawn coefficients none was, and it is what a refit with this error leaves."""
    if truth["strength_asked"] is None:
        return math.nan, remaining(fit_before)
    return truth["strength_asked"], truth["strength_together"]


def judge(truth: Mapping[str, Any], report: Mapping[str, Any], seconds: float) -> Judged:
    """From truth.json and the report's JSON."""
    noise = report["output"]["noise_sigma"]
    added = tuple(effect["name"] for effect in report["effects"] if effect["added"])
    confounders = [one["confounder"] for one in report["confounders"] if one["weight"] >= CONFUSABLE]
    unknown = [term["equation"] for term in report["unknown"] if _told_among(term, report["unknown"])]
    before = _error(report["runs"], "fit", "before", noise)
    asked, strength = asked_and_strength(truth, before)
    alone = [one["strength"] for one in truth["effects"].values()]
    return Judged(
        case=truth["case"],
        kind=kind_of(truth),
        rig=truth["rig"],
        asked=asked,
        strength=strength,
        truth=names_of(truth),
        equations=equations_of(truth),
        verdict=report["verdict"],
        added=added,
        named=tuple(dict.fromkeys([*added, *confounders])),
        where=tuple(dict.fromkeys([*(LIBRARY[name].candidate.equation for name in added), *unknown])),
        fit_before=before,
        fit_after=_error(report["runs"], "fit", "after", noise),
        held_out_before=_error(report["runs"], "held-out", "before", noise),
        held_out_after=_error(report["runs"], "held-out", "after", noise),
        seconds=seconds,
        weakest=math.nan if None in alone else min(map(float, alone), default=0.0),
    )


def load(path: Path) -> Judged:
    """One that `save` wrote."""
    record: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    fields: dict[str, Any] = {name: tuple(one) if isinstance(one, list) else one for name, one in record.items()}
    return Judged(**fields)


def save(one: Judged, path: Path) -> None:
    """Whole or not at all."""
    replace(path, json.dumps(asdict(one), indent=1) + "\n")
