r"""Phase kinetics: temperature, stress and memory -> martensite fraction (eq. 3.3-3.6, 3.17, 3.18, 3.26 corrected).

Both branches are closed forms of one driving temperature each, $y_A = T - \sigma/C_A$ and $y_M = T - \sigma/C_M$:

    heating   xi = min(xi, xi_M h(y_A)),            h falls from 1 at A_s to 0 at A_f   (eq. 3.3)
    cooling   xi = max(xi, 1 - (1 - xi_A) k(y_M)),  k rises from 0 at M_f to 1 at M_s   (eq. 3.5)

so no step leaves [0, 1] and no stress has used a rate that a clipped fraction then denies. A law is a choice of four parts, each a file beside this one
(`laws.py` has the authors' choices): the `shape` of h and k, the `conditions` under which a branch is followed, the
`renewal` of the carried amplitudes xi_M and xi_A, and the `variants` of martensite.
"""

from __future__ import annotations

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar, WireState
from smajax.model.wire.branch_amplitude import FINISHED, AbstractRenewal, Corrected, beyond
from smajax.model.wire.conditions import AbstractConditions
from smajax.model.wire.history import kept_after, over
from smajax.model.wire.shape import AbstractShape, Cosine
from smajax.model.wire.variants import AbstractVariants, Single

# A transformation range narrower than this is a jump that no step can follow.
NARROWEST_RANGE = 0.05  # C


class Kinetics(eqx.Module):
    """Transformation temperatures at zero stress, their slopes, and the four parts of a law."""

    austenite_start: Scalar = parameter("degC", -100.0, 400.0, "A_s at zero stress")
    austenite_finish: Scalar = parameter("degC", -100.0, 400.0, "A_f at zero stress")
    martensite_start: Scalar = parameter("degC", -150.0, 400.0, "M_s at zero stress")
    martensite_finish: Scalar = parameter("degC", -150.0, 400.0, "M_f at zero stress")
    stress_slope_austenite: Scalar = parameter("Pa/K", 1e6, 1e8, "C_A: stress per degree of A_s and A_f")
    stress_slope_martensite: Scalar = parameter("Pa/K", 1e6, 1e8, "C_M: stress per degree of M_s and M_f")
    conditions: AbstractConditions
    shape: AbstractShape = Cosine()
    renewal: AbstractRenewal = Corrected()
    variants: AbstractVariants = Single()


def heating_temperature(law: Kinetics, temperature: Scalar, stress: Scalar) -> Scalar:
    r"""$y_A = T - \sigma / C_A$, C: what has to pass A_s and A_f."""
    return temperature - stress / law.stress_slope_austenite


def cooling_temperature(law: Kinetics, temperature: Scalar, stress: Scalar) -> Scalar:
    r"""$y_M = T - \sigma / C_M$, C: what has to pass M_s and M_f."""
    return temperature - stress / law.stress_slope_martensite


def heating_width(law: Kinetics) -> Scalar:
    """A_f - A_s, C."""
    return jnp.maximum(law.austenite_finish - law.austenite_start, NARROWEST_RANGE)


def cooling_width(law: Kinetics) -> Scalar:
    """M_s - M_f, C."""
    return jnp.maximum(law.martensite_start - law.martensite_finish, NARROWEST_RANGE)


def heating_distance(
    law: Kinetics, effects: Sequence[AbstractEffect], temperature: Scalar, stress: Scalar, old: WireState | None
) -> Scalar:
    """z = (y_A - A_s)/(A_f - A_s) of a step from `old`, which only effects look at."""
    z = (heating_temperature(law, temperature, stress) - law.austenite_start) / heating_width(law)
    for effect in effects:
        assert old is not None, "what has effects is given the wire before the step"
        z = effect.heating_distance(law, z, temperature, stress, old)
    return z


def cooling_distance(
    law: Kinetics, effects: Sequence[AbstractEffect], temperature: Scalar, stress: Scalar, old: WireState | None
) -> Scalar:
    """z = (y_M - M_f)/(M_s - M_f), likewise."""
    z = (cooling_temperature(law, temperature, stress) - law.martensite_finish) / cooling_width(law)
    for effect in effects:
        assert old is not None, "what has effects is given the wire before the step"
        z = effect.cooling_distance(law, z, temperature, stress, old)
    return z


def _or_none(share: Scalar) -> Scalar:
    return jnp.where(share > FINISHED, share, 0.0)


def martensite_left(
    law: Kinetics,
    effects: Sequence[AbstractEffect],
    temperature: Scalar,
    stress: Scalar,
    old: WireState | None = None,
) -> Scalar:
    r"""h((y_A - A_s)/(A_f - A_s)) of the law's shape and the effects: 1 below the range (Elahinia 2004, eq. 3.10)."""
    z = heating_distance(law, effects, temperature, stress, old)
    share = law.shape.martensite_left(z)
    for effect in effects:
        share = effect.heating_shape(z, share)
    return _or_none(share)


def austenite_left(
    law: Kinetics,
    effects: Sequence[AbstractEffect],
    temperature: Scalar,
    stress: Scalar,
    old: WireState | None = None,
) -> Scalar:
    r"""k((y_M - M_f)/(M_s - M_f)) of the law's shape and the effects: 1 above the range (Elahinia 2004, eq. 3.5)."""
    z = cooling_distance(law, effects, temperature, stress, old)
    share = law.shape.austenite_left(z)
    for effect in effects:
        share = effect.cooling_shape(z, share)
    return _or_none(share)


def steepest_slope(law: Kinetics) -> Scalar:
    """About the largest |d xi / dT| of either branch, 1/C: that of the shape over the narrower range."""
    widths = jnp.minimum(law.austenite_finish - law.austenite_start, law.martensite_start - law.martensite_finish)
    return law.shape.steepest() / jnp.maximum(widths, NARROWEST_RANGE)


class Branch(eqx.Module):
    """Which branch a step is on; both False: no transformation."""

    heating: Bool[Array, ""]
    cooling: Bool[Array, ""]
    parts: tuple[Branch, Branch] | None = None  # of a wire in two parts (`mixture.py`)


def _shares(law: Kinetics, effects: Sequence[AbstractEffect], state: WireState) -> tuple[Scalar, Scalar]:
    """(h, k) at a state."""
    at = state.temperature, state.stress, over(state, 0.0)
    return martensite_left(law, effects, *at), austenite_left(law, effects, *at)


def curves(
    law: Kinetics, effects: Sequence[AbstractEffect], state: WireState, temperature: Scalar, stress: Scalar
) -> tuple[Scalar, Scalar]:
    """xi on the heating curve (eq. 3.3) and on the cooling curve (eq. 3.5) that belong to `state`."""
    at = temperature, stress, state
    h, k = martensite_left(law, effects, *at), austenite_left(law, effects, *at)
    return law.renewal.curves(state, *_shares(law, effects, state), h, k)


def curve_on(
    law: Kinetics,
    effects: Sequence[AbstractEffect],
    state: WireState,
    branch: Branch,
    temperature: Scalar,
    stress: Scalar,
) -> Scalar:
    """`fraction_on` of `curves`, with the one shape of the branch computed, where no effect shapes the two apart."""
    if any(effect.shapes() for effect in effects):
        return fraction_on(state, branch, *curves(law, effects, state, temperature, stress))
    at = temperature, stress, state
    mirrored = 1.0 - cooling_distance(law, effects, *at)
    z = jnp.where(branch.cooling, mirrored, heating_distance(law, effects, *at))
    share = _or_none(law.shape.martensite_left(z))
    return fraction_on(state, branch, *law.renewal.curves(state, *_shares(law, effects, state), share, share))


def open_branches(law: Kinetics, effects: Sequence[AbstractEffect], state: WireState) -> Branch:
    """Branches whose range the wire is in (or before) at `state`: one that is behind it transforms nothing any more."""
    if any(effect.shapes() for effect in effects):
        h, k = _shares(law, effects, state)
        return Branch(h > 0.0, k > 0.0)
    at = state.temperature, state.stress, over(state, 0.0)
    left = law.shape.anything_left
    return Branch(left(heating_distance(law, effects, *at)), left(1.0 - cooling_distance(law, effects, *at)))


def _tightening(
    law: Kinetics, effects: Sequence[AbstractEffect], state: WireState, temperature: Scalar, stress: Scalar
) -> tuple[Scalar, Scalar]:
    """Change of stress of a step as the directions of heating and of cooling see it, Pa.

    Where an effect moves a range, the stress that would have moved it as far: the enhanced conditions ask whether the
    wire goes through the range, not why.
    """
    tighter = stress - state.stress
    if not any(effect.displaces() for effect in effects):
        return tighter, tighter
    warmer = temperature - state.temperature
    new, old = (temperature, stress, state), (state.temperature, state.stress, over(state, 0.0))
    heated = heating_width(law) * (heating_distance(law, effects, *new) - heating_distance(law, effects, *old))
    cooled = cooling_width(law) * (cooling_distance(law, effects, *new) - cooling_distance(law, effects, *old))
    return (warmer - heated) * law.stress_slope_austenite, (warmer - cooled) * law.stress_slope_martensite


def choose_branch(
    law: Kinetics,
    effects: Sequence[AbstractEffect],
    state: WireState,
    open_at_start: Branch,
    temperature: Scalar,
    stress: Scalar,
    heated: Scalar,
    cooled: Scalar,
) -> Branch:
    """The branch on which a step to (`temperature`, `stress`), tried with the fraction frozen, has to transform.

    `heated` and `cooled` are the curves there. The ranges are [A_s', A_f'] for heating and [M_f', M_s'] for cooling
    (eq. 3.18 prints A_s in the place of M_s, twice; Table 3.3 and eq. 3.6 have M_s).
    """
    warmer = temperature - state.temperature
    tighter, tighter_cooling = _tightening(law, effects, state, temperature, stress)
    loss, gain = state.martensite_fraction - heated, cooled - state.martensite_fraction
    loaded = state.formed_by_loading > 0.5
    may_heat = law.conditions.heats(warmer, tighter, law.stress_slope_austenite, loaded) & open_at_start.heating
    may_cool = law.conditions.cools(warmer, tighter_cooling, law.stress_slope_martensite) & open_at_start.cooling
    heating, cooling = beyond(loss) & may_heat, beyond(gain) & may_cool
    # Overlapping ranges can ask for both; one step transforms one way only (source, after eq. 3.26).
    return Branch(heating & ~(cooling & (gain > loss)), cooling & ~(heating & (gain <= loss)))


def fraction_on(state: WireState, branch: Branch, heated: Scalar, cooled: Scalar) -> Scalar:
    """xi at the end of a step on `branch`; unchanged off both.

    The branch was chosen where its curve lies beyond the present fraction, and the caller stays on that side.
    """
    return jnp.where(branch.heating, heated, jnp.where(branch.cooling, cooled, state.martensite_fraction))


def remembered(
    law: Kinetics,
    effects: Sequence[AbstractEffect],
    old: WireState,
    branch: Branch,
    temperature: Scalar,
    stress: Scalar,
    strain: Scalar,
    xi: Scalar,
) -> WireState:
    """The wire after a step that ended at (`temperature`, `stress`, `strain`, `xi`), its memory brought up to date."""
    at = temperature, stress, old
    h, k = martensite_left(law, effects, *at), austenite_left(law, effects, *at)
    kept = law.renewal.renewed(old, branch.heating, branch.cooling, h, k, xi)
    by_loading = (stress - old.stress) / law.stress_slope_martensite > old.temperature - temperature
    formed_by_loading = jnp.where(branch.cooling, 1.0 * by_loading, old.formed_by_loading)
    detwinned = law.variants.detwinned(old, stress, xi)
    return WireState(
        temperature,
        stress,
        strain,
        xi,
        kept.xi_M,
        kept.xi_A,
        kept.heating_missed,
        kept.cooling_missed,
        detwinned,
        formed_by_loading,
        kept_after(effects, old, temperature, stress, xi),
    )
