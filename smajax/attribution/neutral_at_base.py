"""Whether effects of other packages change nothing at their base value, which every verdict of `close-loop` rests on."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import jax.numpy as jnp
import numpy as np

from smajax.core.display_units import display, label
from smajax.core.plugins import EFFECTS, PluginError, points_of, whose
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.library import of_others
from smajax.model.presets import build
from smajax.model.system import System
from smajax.model.types import Series
from smajax.simulation.compiled import simulate_compiled

NOTHING = 1e-6  # of a variable's range in the run: what another order of sums may make of it
SECONDS, DT = 12.0, 0.02
# What a coupon has no law for, as `smajax.data.model_catalogue.candidates` has it.
HEATED = {"heat", "electrical", "mechanics"}


def _rigs() -> Iterator[tuple[System, dict[str, Series]]]:
    """Benches of every kind of load, each with a run through both transformations and back."""
    time = jnp.arange(0.0, SECONDS, DT)
    on = (time < 0.5 * SECONDS) * 1.0
    cycle = 0.5 - 0.5 * jnp.cos(2.0 * jnp.pi * time / SECONDS)
    for wire, load, drive, channel, top in (
        ("flexinol_table_3_2", "dead_weight", "voltage", "voltage", 7.4),
        ("flexinol_ht_500um", "bias_spring", "duty", "duty", 0.35),
        ("niti_table_3_1", "arm", "amplified_voltage", "voltage", 8.0),
        ("flexinol_table_3_2", "dead_weight", "current", "current", 0.7),
        ("flexinol_table_3_2", "dead_weight", "power", "power", 6.0),
    ):
        yield build(wire, load, drive), {channel: top * on}
    oven = {"temperature": 25.0 + 100.0 * cycle}
    yield build("flexinol_isobaric", "coupon", "none"), {**oven, "stress": jnp.full_like(time, 100e6)}
    yield build("flexinol_isobaric", "strain_coupon", "none"), {**oven, "strain": 0.02 * cycle}


def shift(effect: type[AbstractEffect]) -> str:
    """What `effect` at its base value changes, in words; nothing if it changes nothing, or applies to none of our loads."""
    for system, inputs in _rigs():
        if not effect.candidate.applies(system) or ("temperature" in inputs and effect.candidate.equation in HEATED):
            continue
        with_it = dataclasses.replace(system, effects=(effect.base(),))
        plain, changed = simulate_compiled(system, inputs, DT), simulate_compiled(with_it, inputs, DT)
        name, unit = system.load.reading
        changes = []
        for what, unit_of in (("reading", unit), ("temperature", "degC"), ("stress", "Pa")):
            before, after = np.asarray(getattr(plain, what)), np.asarray(getattr(changed, what))
            called = name if what == "reading" else what
            if not np.isfinite(after).all():
                changes.append(f"the {label(called)} to no number")
                continue
            most = float(np.abs(after - before).max())
            if most > NOTHING * max(float(np.ptp(before)), 1e-3 * float(np.abs(before).max())):
                seen = display(unit_of, called)
                changes.append(f"the {label(called)} by up to {seen.with_unit(most, 3)}")
        return ", ".join(changes)
    return ""


def not_neutral() -> list[str]:
    """A sentence an effect of another package that changes the model at its base value: which, and by how much."""
    points = {point.name: whose(point) for point in points_of(EFFECTS)}
    faults = []
    for name, effect in of_others().items():
        begin = f"{points.get(name, name)} brings the effect {name!r}, which"
        try:
            changes = shift(effect)
        except Exception as error:
            faults.append(f"{begin} cannot be simulated ({error!r}): mend or uninstall that package.")
            continue
        if changes:
            faults.append(
                f"{begin} must change nothing at its base value and changes {changes}: mend its methods or `base` there, or "
                "uninstall that package."
            )
    return faults


def check_neutral() -> None:
    """Raises PluginError for effects of other packages that change the model at their base value."""
    if faults := not_neutral():
        raise PluginError("\n".join(faults))
