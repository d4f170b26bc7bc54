"""VSC3's slope, layer and velocity filter, one set for C4, C5 and C7; and VSC2 with the same layer (C4).

The text: VSC3 takes 3 s to 0 degrees without overshoot and with a greatly reduced steady error, and is "fast and accurate regardless of
the desired angular position" (sec. 4.4.4); its velocity is a "numerical derivative approximation ... obtained by filtering out the noise".
VSC2 has no chatter, overshoots and settles in 8 s.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.controllers.base import AbstractController
from smajax.control.controllers.boundary_layer import AsPrinted
from smajax.control.controllers.vsc2 import Vsc2
from smajax.control.controllers.vsc3 import Vsc3
from smajax.control.figures_of_merit import merit
from smajax.control.reference import clock, constant
from smajax.model.rigs import arm
from studies.source.c04_three_switches import LATE, PRINTED, comes_to_rest
from studies.source.set_points import PERIOD, SECONDS, SET_POINTS
from studies.source.unprinted import HIGH_VOLTAGE, LAYER

from .candidates import drawn, each

CANDIDATES, SEED = 360, 0
BOX = {"surface_slope": (0.9, 2.6), "boundary": (0.05, 0.3), "rate_filter": (0.003, 0.4)}  # 1/s, rad/s, s
LAYERS = (0.03, 0.035, 0.04, 0.045, 0.05, 0.055, 0.06)  # rad
EDGES = (10.0, 9.0, 8.0, 7.0, 6.5, 6.0, 5.5, 5.0)  # V at s = -phi
AT_REST = 0.6  # deg/s, a tenth of VSC1's cycle


@eqx.filter_jit
def _regulated(
    make: Callable[[Any], AbstractController], gains: Any, targets: Any, seconds: float, dt: float
) -> tuple[Any, Any]:
    system, time = arm(), clock(seconds, dt)

    def one(row: Any, target: Any) -> Any:
        loop = simulate_closed_loop(system, make(row), constant(time, target), dt, round(PERIOD / dt))
        return merit(loop, system), loop.run.position

    return each(one, gains, targets, 32)


def _surface(row: Any) -> AbstractController:
    return Vsc3(10.0, 4.0, row[0], row[1], row[2])


def _layer(row: Any) -> AbstractController:
    return Vsc2(10.0, 4.0, row[0], AsPrinted(-row[1] / row[0]))


@functools.cache
def _candidates() -> tuple[np.ndarray, np.ndarray]:
    """(random candidates, the largest share of a limit of C4 and C5 that each has)."""
    gains = drawn(BOX, CANDIDATES, SEED)
    one, _ = jax.tree.map(
        np.asarray, _regulated(_surface, jnp.asarray(gains), jnp.radians(jnp.asarray(SET_POINTS)), SECONDS, PERIOD)
    )
    zero = SET_POINTS.index(0.0)
    shares = np.stack(
        [
            np.abs(one.settling_time[:, zero] / PRINTED["VSC3"] - 1.0) / 0.25,
            np.degrees(one.overshoot[:, zero]) / 0.2,
            np.degrees(one.steady_error[:, zero]) / 0.25,
            one.reach_time.max(axis=1) / 4.0,
            np.degrees(one.steady_error).max(axis=1) / 0.5,
            np.degrees(one.overshoot).max(axis=1) / 2.5,
        ],
        axis=1,
    )
    return gains, np.nan_to_num(shares, nan=99.0, posinf=99.0).max(axis=1)


def surface() -> dict[str, Any]:
    """The random candidate that meets every limit of C4 and C5 by most, counted in shares of each limit."""
    gains, worst = _candidates()
    best = int(worst.argmin())
    return {
        "values": {name: float(f"{value:.3g}") for name, value in zip(BOX, gains[best], strict=True)},
        "meet_all": int((worst < 1.0).sum()),
        "tried": CANDIDATES,
        "largest_share_of_a_limit": round(float(worst[best]), 3),
    }


def layer() -> dict[str, Any]:
    """VSC2 with the layer of VSC3's surface and V_high at its edge, and what other layers do.

    Others: those of all candidates of `surface` that meet every limit, and a grid, of which those count that two step sizes agree on and that
    stand still from 8.5 s on.
    """
    gains, worst = _candidates()
    others = sorted(row[1] / row[0] for row in gains[worst < 1.0])
    own = [(LAYER["boundary"], HIGH_VOLTAGE)]
    grid = own + [(width, HIGH_VOLTAGE) for width in others] + [(width, edge) for width in LAYERS for edge in EDGES]
    rests: list[Any] = []
    stands: list[Any] = []
    for dt in (PERIOD, PERIOD / 2):
        _, position = _regulated(_layer, jnp.asarray(grid), jnp.zeros(1), SECONDS, dt)
        angle = np.degrees(np.asarray(position)[:, 0])
        time = dt * np.arange(angle.shape[1])
        rests.append(np.array([comes_to_rest(time, one) for one in angle]))
        late = angle[:, time > LATE]
        stands.append(np.ptp(np.diff(late, axis=1) / dt, axis=1) < AT_REST)
    agree = (np.abs(rests[0] - rests[1]) < 0.05) & stands[0] & stands[1]
    theirs, anywhere = slice(1, 1 + len(others)), slice(1 + len(others), None)
    near = np.abs(rests[1] / PRINTED["VSC2"] - 1.0) < 0.25
    return {
        "values": dict(LAYER),
        "comes_to_rest_s": [round(float(rest[0]), 3) for rest in rests],
        "stands_still": bool(agree[0]),
        "layers_of_other_surfaces_rad": [round(float(others[0]), 4), round(float(others[-1]), 4)],
        "of_these": len(others),
        "rest_after_s": [round(float(rests[1][theirs].min()), 2), round(float(rests[1][theirs].max()), 2)],
        "near_8_s": int(near[theirs].sum()),
        "other_layers": {
            "tried": len(LAYERS) * len(EDGES),
            "agree_and_stand_still": int(agree[anywhere].sum()),
            "rest_after_s": [round(float(np.min(rests[1][anywhere])), 2), round(float(np.max(rests[1][anywhere])), 2)],
        },
    }
