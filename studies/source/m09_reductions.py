"""M9: the enhanced conditions are Liang's at constant stress and Brinson's at constant temperature (sec. 3.6)."""

from __future__ import annotations

import dataclasses
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from smajax.core.parameters import set_parameters
from smajax.model.rigs import coupon
from smajax.model.system import System
from smajax.model.wire.conditions import AbstractConditions, Brinson, BrinsonAsPrinted
from smajax.report.drawing import LAW_COLOURS, keyed, named, panels

from .rigs import Recorded, batch
from .row import Result, Row

Pairs = dict[str, tuple[Recorded, Recorded]]  # kind of path -> the runs of the two conditions that are compared


def _wandering(rng: np.random.Generator, low: float, high: float, samples: int) -> np.ndarray:
    """A path through eight random levels, so that there are reversals inside the range."""
    levels = np.concatenate([[low], rng.uniform(low, high, 8), [low]])
    return np.interp(np.linspace(0.0, 9.0, samples), np.arange(10.0), levels)


def _draw(figure: Figure, shown: Pairs, stress: np.ndarray, temperature: np.ndarray) -> None:
    """The trial of each kind with the most transformation to and fro."""
    busiest = {
        key: int(np.abs(np.diff(pair[0].martensite_fraction)).sum(axis=1).argmax()) for key, pair in shown.items()
    }
    left, right = panels(figure, 1, 2)
    for axes, key, law, across in (
        (left, "isobaric", "liang", lambda run: run.temperature),
        (right, "isothermal", "brinson", lambda run: run.stress / 1e6),
    ):
        ours, theirs = (jax.tree.map(lambda a: a[busiest[key]], run) for run in shown[key])  # noqa: B023
        axes.plot(across(theirs), theirs.martensite_fraction, color=LAW_COLOURS[law], linewidth=3, label=law)
        axes.plot(across(ours), ours.martensite_fraction, color=LAW_COLOURS["enhanced"], linewidth=1, label="enhanced")
        keyed(axes)
    named(
        left,
        "temperature (°C)",
        "martensite fraction",
        f"constant stress {stress[busiest['isobaric']] / 1e6:.0f} MPa",
    )
    named(
        right,
        "stress (MPa)",
        "martensite fraction",
        f"constant temperature {temperature[busiest['isothermal']]:.0f} °C",
    )


def work(fast: bool) -> Result:
    """Random isobaric and isothermal paths, partial loops among them."""
    rng = np.random.default_rng(2004)
    trials, samples = (5, 400) if fast else (25, 2000)
    enhanced = coupon("enhanced")

    def with_conditions(conditions: AbstractConditions) -> System:
        kinetics = dataclasses.replace(enhanced.wire.kinetics, conditions=conditions)
        return dataclasses.replace(enhanced, wire=dataclasses.replace(enhanced.wire, kinetics=kinetics))

    stress = rng.uniform(20e6, 250e6, trials)
    path = np.stack([_wandering(rng, 23.0, 90.0 + level / 6.89e6, samples) for level in stress])
    inputs = {"temperature": jnp.asarray(path), "stress": jnp.asarray(stress[:, None] * np.ones(samples))}
    shown = {"isobaric": (batch(enhanced, inputs, 1.0), batch(coupon("liang"), inputs, 1.0))}
    # From austenite: loading forms martensite, unloading takes it back. Brinson's conditions, once as the source
    # describes them and once as Table 3.3 prints them.
    temperature = rng.uniform(60.0, 110.0, trials)
    path = np.stack([_wandering(rng, 0.0, 500e6, samples) for _ in temperature])
    inputs = {"temperature": jnp.asarray(temperature[:, None] * np.ones(samples)), "stress": jnp.asarray(path)}
    ours, theirs, table = (
        batch(set_parameters(system, {"start_fraction": 0.0}), inputs, 1.0)
        for system in (enhanced, with_conditions(Brinson()), with_conditions(BrinsonAsPrinted()))
    )
    shown["isothermal"] = ours, theirs
    isobaric, isothermal, printed = (
        float(np.abs(one.martensite_fraction - other.martensite_fraction).max())
        for one, other in (shown["isobaric"], (ours, theirs), (ours, table))
    )
    # The same conditions on martensite that cooling had formed: there Brinson's, as the source describes them, do nothing.
    formed = {
        "temperature": jnp.full((1, 401), 75.0),
        "stress": jnp.asarray(np.interp(np.arange(401), [0, 200, 400], [200e6, 0, 200e6]))[None],
    }
    cooled = {
        name: float(batch(system, formed, 1.0).martensite_fraction[0, 200])
        for name, system in (
            ("enhanced", enhanced),
            ("brinson", with_conditions(Brinson())),
            ("printed", with_conditions(BrinsonAsPrinted())),
        )
    }
    return Result(
        holds=isobaric == isothermal == printed == 0.0,
        found=f"largest difference in xi over {trials} random paths each: {isobaric:g} at constant stress (Liang), "
        f"{isothermal:g} at constant temperature (Brinson; {printed:g} with the conditions as Table 3.3 prints them)",
        numbers={
            "isobaric_difference": isobaric,
            "isothermal_difference": isothermal,
            "printed_difference": printed,
            **{f"unloaded_cooled_martensite_{name}": value for name, value in cooled.items()},
        },
        draw=partial(_draw, shown=shown, stress=stress, temperature=temperature),
        caveat="at constant temperature for martensite that loading had formed. The source contradicts itself here: of "
        "martensite formed by cooling it says (below eq. 3.12, and M7 c) that Brinson's conditions transform nothing on "
        f"unloading. Unloaded at 75 °C such martensite ends at xi = {cooled['enhanced']:.2f} (enhanced, and Brinson as Table 3.3 "
        f"prints it: {cooled['printed']:.2f}) and at {cooled['brinson']:.2f} (Brinson as the text has it).",
    )


ROW = Row(
    "M9",
    "sec. 3.6, Table 3.3",
    "wire",
    "the enhanced conditions reduce to Liang's at constant stress and to Brinson's at constant temperature",
    work,
)
