"""Error of the integrator against its step, and how the default was chosen: `python -m studies.convergence [--fast]`.

Against the event-aware scipy integration of `studies/reference` (DOP853, rtol 1e-9): the arm's steps of 7.2 and 7.3 V
(M2, M3), the dead weight heated and cooled (M11) and with a mass taken off and put back (M13), and twenty seconds of
regulation at 85 degrees. Shown are the largest errors at any compared time of the angle (of the position over 10 mm, for
the weight) and of the fraction.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.presets import stress_sliding
from smajax.core.runtime import prepare
from smajax.model.presets import build
from smajax.model.system import initial_state
from smajax.report.drawing import GREY, keyed, named, panels
from smajax.simulation.simulate import DEFAULT_STEP, simulate
from studies.reference.sliding import sliding_controller
from studies.reference.wire_parameters import ArmParameters, DeadWeightParameters
from studies.reference.wire_reference import simulate_arm, simulate_dead_weight
from studies.source.rigs import compiled

PICTURE = Path(__file__).parent / "convergence.png"
STEPS = (0.04, 0.02, 0.01, 0.005, 0.0025)
EVERY = 0.04  # s between compared times
PERIOD = 0.04  # s, of the controller: a multiple of every step
RUN, CONTROLLED = compiled(simulate), compiled(simulate_closed_loop)
Errors = tuple[float, float]  # of the position, in units that the two limits below are in; of the fraction
LIMITS = (0.05, 1e-3)  # degrees (per cent of 10 mm), -


def arm_parameters() -> ArmParameters:
    """The arm preset in the reference's words."""
    arm = build("niti_table_3_1", "arm", "amplified_voltage")
    start = initial_state(arm, {"voltage": jnp.asarray(0.0)})
    return ArmParameters(
        surface_per_metre=float(np.pi * 150e-6),
        initial_stress=float(start.wire.stress),
        recoverable_strain=float(arm.wire.constitutive.recoverable_strain),
        spring_radius=float(arm.load.spring_lever),
    )


def _times(seconds: float) -> np.ndarray:
    return np.arange(round(seconds / EVERY) + 1) * EVERY


def _arm_step(volts: float, seconds: float) -> Callable[[float], Errors]:
    exact = simulate_arm(arm_parameters(), [(seconds, volts)], _times(seconds))

    def errors(dt: float) -> Errors:
        got = RUN(
            build("niti_table_3_1", "arm", "amplified_voltage"),
            {"voltage": jnp.full(round(seconds / dt) + 1, volts)},
            dt,
        )
        at = slice(None, None, round(EVERY / dt))
        return (
            float(np.degrees(np.abs(got.position[at] - exact["angle"]).max())),
            float(np.abs(got.martensite_fraction[at] - exact["martensite_fraction"]).max()),
        )

    return errors


def _weight(segments: list[tuple[float, float, float]]) -> Callable[[float], Errors]:
    seconds = segments[-1][0]
    exact = simulate_dead_weight(DeadWeightParameters(), segments, _times(seconds))

    def errors(dt: float) -> Errors:
        time = np.arange(round(seconds / dt) + 1) * dt
        which = np.searchsorted([end - 1e-9 for end, _, _ in segments[:-1]], time, side="right")
        volts, mass = (np.array([segment[k] for segment in segments])[which] for k in (1, 2))
        inputs = {"voltage": jnp.asarray(volts), "mass": jnp.asarray(mass)}
        got = RUN(build("flexinol_table_3_2", "dead_weight", "voltage"), inputs, dt)
        at = slice(None, None, round(EVERY / dt))
        return (
            float(np.abs(got.position[at] - exact["position"]).max() / 1e-4),
            float(np.abs(got.martensite_fraction[at] - exact["martensite_fraction"]).max()),
        )

    return errors


def _regulated(seconds: float) -> Callable[[float], Errors]:
    arm = build("niti_table_3_1", "arm", "amplified_voltage")
    ours, wanted = stress_sliding(arm), np.radians(85.0)
    exact = simulate_arm(
        arm_parameters(),
        [],
        _times(seconds),
        controller=sliding_controller(ours, wanted, PERIOD),
        period=PERIOD,
        memory=0.0,
    )

    def errors(dt: float) -> Errors:
        target = jnp.full(round(seconds / dt) + 1, wanted)
        got = CONTROLLED(arm, ours, target, dt, round(PERIOD / dt)).run
        at = slice(None, None, round(EVERY / dt))
        return (
            float(np.degrees(np.abs(got.position[at] - exact["angle"]).max())),
            float(np.abs(got.martensite_fraction[at] - exact["martensite_fraction"]).max()),
        )

    return errors


def cases(fast: bool) -> dict[str, Callable[[float], Errors]]:
    """Each rig's errors as a function of the step; the reference is made here."""
    seconds = 8.0 if fast else 20.0
    result = {
        "M3: arm, 7.3 V": _arm_step(7.3, 12.0 if fast else 20.0),
        "M11: 75 g, 7.4 V on and off": _weight([(4.0, 7.4, 0.075), (8.0, 0.0, 0.075)]),
    }
    if not fast:
        result["M2: arm, 7.2 V"] = _arm_step(7.2, 20.0)
        result["M13: 363 g, 96 g off and on"] = _weight([(12.0, 7.95, 0.363), (16.0, 7.95, 0.267), (20.0, 7.95, 0.363)])
    result["arm regulated at 85°"] = _regulated(seconds)
    return result


def main(fast: bool = False) -> dict[str, list[Errors]]:
    """Print the table, draw the picture; errors by case, in the order of `STEPS`."""
    steps = STEPS[2:] if fast else STEPS
    table = {name: [errors(dt) for dt in steps] for name, errors in cases(fast).items()}
    print(
        f"{'largest error of angle (deg; % of 10 mm) / of the fraction':60}" + "".join(f"{dt:>20g} s" for dt in steps)
    )
    for name, row in table.items():
        print(f"{name:60}" + "".join(f"{a:>12.1e} / {x:.1e}" for a, x in row))
    print(f"default step: {DEFAULT_STEP:g} s; asked for: {LIMITS[0]:g} and {LIMITS[1]:g}")
    if not fast:
        figure = Figure(figsize=(9.0, 4.2))
        for k, (axes, name) in enumerate(
            zip(panels(figure, 1, 2), ("angle (°), position (% of 10 mm)", "martensite fraction"), strict=True)
        ):
            for case, row in table.items():
                axes.loglog(steps, [errors[k] for errors in row], "o-", markersize=3, label=case)
            axes.loglog(steps, [0.3 * LIMITS[k] * (dt / 0.01) ** 2 for dt in steps], ":", color=GREY, label="order 2")
            axes.set_xticks(steps, [f"{1e3 * dt:g}" for dt in steps])
            axes.minorticks_off()
            axes.axhline(LIMITS[k], linestyle="--", color=GREY)
            axes.axvline(DEFAULT_STEP, linestyle="--", color=GREY)
            named(axes, "step (ms)", f"largest error: {name}")
        keyed(figure.axes[0])
        figure.savefig(PICTURE, dpi=90)
    return table


if __name__ == "__main__":
    prepare()
    main("--fast" in sys.argv)
