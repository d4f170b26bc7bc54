"""The input series that act on a system, from those that were recorded: an effect may say that they are late."""

from __future__ import annotations

from collections.abc import Mapping

import jax
import jax.numpy as jnp
from jax import lax

from smajax.model.drive.inputs import with_switch
from smajax.model.load.coupon import AbstractCoupon
from smajax.model.system import System, recorded_apart
from smajax.model.types import Inputs, Scalar, Series


def refuse_lag(system: System, what: str) -> None:
    """ValueError where an effect shifts the input in time, of which `what` knows no series."""
    for term in system.terms.input_lag:
        raise ValueError(
            f"`{term.effect_name}` shifts a recorded input in time, but {what} makes its input as it goes: leave the effect's values out of --set "
            "and --mismatch (of a system: `smajax.model.extended.without_input_lag`), and give a closed loop its delay in control periods "
            "(--delay, `delay=`)."
        )


def acting_inputs(system: System, series: Mapping[str, Series], dt: Scalar | float) -> dict[str, Series]:
    """`series` (each of shape (n,), `dt` seconds apart) with the channels `recorded_apart` as late as the effects say.

    A lag of a part of a step gives two commands that hold one after the other (`with_switch`), and of what was measured at the
    samples (a coupon's temperature) two straight lines that meet at a sample: where a temperature turns it is reached, and not cut off.
    Beyond its ends a series is as at them.
    """
    late, acting = system.terms.input_lag, dict(series)
    channels = sorted(recorded_apart(system) & set(series))
    if not late or not channels:
        return acting
    last = jnp.shape(acting[channels[0]])[0] - 1

    def shifted(_: None, number: jax.Array) -> tuple[None, tuple[Scalar, Inputs, Inputs]]:
        lag = sum(effect.input_lag(number * dt) for effect in late) / dt
        whole = jnp.floor(lag)
        newer = number - whole.astype(number.dtype)

        def at(place: jax.Array) -> Inputs:
            within = jnp.clip(place, 0, last)
            return {name: lax.dynamic_index_in_dim(acting[name], within, keepdims=False) for name in channels}

        return None, (lag - whole, at(newer - 1), at(newer))

    # One sample after the other: each run looks up one number at a time, at an index of its own.
    _, (share, older, newer) = lax.scan(shifted, None, jnp.arange(last + 1))
    if isinstance(system.load, AbstractCoupon):
        ends = {name: share * older[name] + (1.0 - share) * newer[name] for name in channels}
        return acting | with_switch(older, ends, share)
    return acting | with_switch(older, newer, share)
