"""M9: the enhanced conditions are Liang's at constant stress and Brinson's at constant temperature (sec. 3.6)."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from smajax.figures.drawing import LAW_COLOURS, keyed, named, panels
from smajax.figures.rigs import coupon, simulated
from smajax.figures.row import Result, Row
from smajax.parameters import set_parameters
from smajax.wire.conditions import Brinson, BrinsonAsPrinted


def _wandering(rng: np.random.Generator, low: float, high: float, samples: int) -> np.ndarray:
    """A path through eight random levels, so that there are reversals inside the range."""
    levels = np.concatenate([[low], rng.uniform(low, high, 8), [low]])
    return np.interp(np.linspace(0.0, 9.0, samples), np.arange(10.0), levels)


def work(fast: bool) -> Result:
    """Random isobaric and isothermal paths, partial loops among them."""
    rng = np.random.default_rng(2004)
    trials, samples = (5, 400) if fast else (25, 2000)
    isobaric = isothermal = printed = 0.0
    shown = {}
    enhanced = coupon("enhanced")
    single = lambda conditions: dataclasses.replace(  # noqa: E731
        enhanced,
        wire=dataclasses.replace(
            enhanced.wire, kinetics=dataclasses.replace(enhanced.wire.kinetics, conditions=conditions)
        ),
    )
    for _ in range(trials):
        stress = rng.uniform(20e6, 250e6)
        path = _wandering(rng, 23.0, 90.0 + stress / 6.89e6, samples)
        inputs = {"temperature": jnp.asarray(path), "stress": jnp.full(samples, stress)}
        ours, theirs = simulated(enhanced, inputs, 1.0), simulated(coupon("liang"), inputs, 1.0)
        isobaric = max(isobaric, float(np.abs(ours.martensite_fraction - theirs.martensite_fraction).max()))
        shown["isobaric"] = ours, theirs
        # From austenite: loading forms martensite, unloading takes it back. Brinson's conditions, once as the source
        # describes them and once as Table 3.3 prints them.
        temperature = rng.uniform(60.0, 110.0)
        path = _wandering(rng, 0.0, 500e6, samples)
        inputs = {"temperature": jnp.full(samples, temperature), "stress": jnp.asarray(path)}
        austenite = {"start_fraction": 0.0}
        ours = simulated(set_parameters(enhanced, austenite), inputs, 1.0)
        theirs = simulated(set_parameters(single(Brinson()), austenite), inputs, 1.0)
        table = simulated(set_parameters(single(BrinsonAsPrinted()), austenite), inputs, 1.0)
        isothermal = max(isothermal, float(np.abs(ours.martensite_fraction - theirs.martensite_fraction).max()))
        printed = max(printed, float(np.abs(ours.martensite_fraction - table.martensite_fraction).max()))
        shown["isothermal"] = ours, theirs

    def draw(figure: Figure) -> None:
        left, right = panels(figure, 1, 2)
        for axes, key, law, across in (
            (left, "isobaric", "liang", lambda run: run.temperature),
            (right, "isothermal", "brinson", lambda run: run.stress / 1e6),
        ):
            ours, theirs = shown[key]
            axes.plot(across(theirs), theirs.martensite_fraction, color=LAW_COLOURS[law], linewidth=3, label=law)
            axes.plot(
                across(ours), ours.martensite_fraction, color=LAW_COLOURS["enhanced"], linewidth=1, label="enhanced"
            )
            keyed(axes)
        named(
            left,
            "temperature (°C)",
            "martensite fraction",
            f"constant stress {shown['isobaric'][0].stress[0] / 1e6:.0f} MPa",
        )
        named(
            right,
            "stress (MPa)",
            "martensite fraction",
            f"constant temperature {shown['isothermal'][0].temperature[0]:.0f} °C",
        )

    return Result(
        holds=isobaric == isothermal == printed == 0.0,
        found=f"largest difference in xi over {trials} random paths each: {isobaric:g} at constant stress (Liang), "
        f"{isothermal:g} at constant temperature (Brinson; {printed:g} with the conditions as Table 3.3 prints them)",
        numbers={"isobaric_difference": isobaric, "isothermal_difference": isothermal, "printed_difference": printed},
        draw=draw,
    )


ROW = Row(
    "M9",
    "sec. 3.6, Table 3.3",
    "wire",
    "the enhanced conditions reduce to Liang's at constant stress and to Brinson's at constant temperature",
    work,
)
