r"""Phase kinetics: temperature, stress and memory -> martensite fraction (eq. 3.3-3.6, 3.17, 3.18, 3.26 corrected).

Both branches are closed forms of one driving temperature each, $y_A = T - \sigma/C_A$ and $y_M = T - \sigma/C_M$:

    heating   xi = min(xi, xi_M h(y_A)),            h falls from 1 at A_s to 0 at A_f   (eq. 3.3)
    cooling   xi = max(xi, 1 - (1 - xi_A) k(y_M)),  k rises from 0 at M_f to 1 at M_s   (eq. 3.5)

so no step leaves [0, 1] and no stress has used a rate that a clipped fraction then denies. A law is a choice of four parts, each a file beside this one
(`laws.py` has the authors' choices): the `shape` of h and k, the `conditions` under which a branch is followed, the
`renewal` of the carried amplitudes xi_M and xi_A, and the `variants` of martensite.
"""

from __future__ import annotations

import dataclasses

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool

from smajax.core.traced_once import traced_once
from smajax.model.types import Scalar, WireState
from smajax.model.wire.branch_amplitude import FINISHED, beyond
from smajax.model.wire.history import over
from smajax.model.wire.kinetics_terms import KineticsTerms
from smajax.model.wire.wire import Kinetics

# A transformation range narrower than this is a jump that no step can follow.
NARROWEST_RANGE = 0.05  # C


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
    law: Kinetics, terms: KineticsTerms, temperature: Scalar, stress: Scalar, old: WireState | None
) -> Scalar:
    """z = (y_A - A_s)/(A_f - A_s) of a step from `old`, which only effects look at."""
    z = (heating_temperature(law, temperature, stress) - law.austenite_start) / heating_width(law)
    for term in terms.ranges:
        assert old is not None, "a range that an effect moves depends on the wire before the step"
        z = term.heating_distance(law, z, temperature, stress, old)
    return z


def cooling_distance(
    law: Kinetics, terms: KineticsTerms, temperature: Scalar, stress: Scalar, old: WireState | None
) -> Scalar:
    """z = (y_M - M_f)/(M_s - M_f), likewise."""
    z = (cooling_temperature(law, temperature, stress) - law.martensite_finish) / cooling_width(law)
    for term in terms.ranges:
        assert old is not None, "a range that an effect moves depends on the wire before the step"
        z = term.cooling_distance(law, z, temperature, stress, old)
    return z


def _or_none(share: Scalar) -> Scalar:
    return jnp.where(share > FINISHED, share, 0.0)


def martensite_left(
    law: Kinetics,
    terms: KineticsTerms,
    temperature: Scalar,
    stress: Scalar,
    old: WireState | None = None,
) -> Scalar:
    r"""h((y_A - A_s)/(A_f - A_s)) of the law's shape and the effects: 1 below the range (Elahinia 2004, eq. 3.10)."""
    z = heating_distance(law, terms, temperature, stress, old)
    place = z
    for placed in terms.places:
        place = placed.heating_place(place)
    share = law.shape.martensite_left(place)
    for term in terms.shapes:
        share = term.heating_shape(z, share)
    return _or_none(share)


def austenite_left(
    law: Kinetics,
    terms: KineticsTerms,
    temperature: Scalar,
    stress: Scalar,
    old: WireState | None = None,
) -> Scalar:
    r"""k((y_M - M_f)/(M_s - M_f)) of the law's shape and the effects: 1 above the range (Elahinia 2004, eq. 3.5)."""
    z = cooling_distance(law, terms, temperature, stress, old)
    place = z
    for placed in terms.places:
        place = placed.cooling_place(place)
    share = law.shape.austenite_left(place)
    for term in terms.shapes:
        share = term.cooling_shape(z, share)
    return _or_none(share)


def steepest_slope(law: Kinetics) -> Scalar:
    """About the largest |d xi / dT| of either branch, 1/C: that of the shape over the narrower range."""
    widths = jnp.minimum(law.austenite_finish - law.austenite_start, law.martensite_start - law.martensite_finish)
    return law.shape.steepest() / jnp.maximum(widths, NARROWEST_RANGE)


class Branch(eqx.Module):
    """Which branch a step is on; both False: no transformation."""

    heating: Bool[Array, ""]
    cooling: Bool[Array, ""]
    parts: tuple[Branch, Branch] | None = None  # of a wire in two populations (`two_populations.py`)


def _shares(law: Kinetics, terms: KineticsTerms, state: WireState) -> tuple[Scalar, Scalar]:
    """(h, k) at a state."""
    at = state.temperature, state.stress, over(state, 0.0)
    return martensite_left(law, terms, *at), austenite_left(law, terms, *at)


@traced_once
def curves(
    law: Kinetics, terms: KineticsTerms, state: WireState, temperature: Scalar, stress: Scalar
) -> tuple[Scalar, Scalar]:
    """xi on the heating curve (eq. 3.3) and on the cooling curve (eq. 3.5) that belong to `state`."""
    at = temperature, stress, state
    h, k = martensite_left(law, terms, *at), austenite_left(law, terms, *at)
    return law.renewal.curves(state, *_shares(law, terms, state), h, k)


@traced_once
def curve_on(
    law: Kinetics,
    terms: KineticsTerms,
    state: WireState,
    branch: Branch,
    temperature: Scalar,
    stress: Scalar,
) -> Scalar:
    """`fraction_on` of `curves`, with the one shape of the branch computed, where no effect shapes the two apart."""
    if terms.shape_branches:
        return fraction_on(state, branch, *curves(law, terms, state, temperature, stress))
    at = temperature, stress, state
    mirrored = 1.0 - cooling_distance(law, terms, *at)
    z = jnp.where(branch.cooling, mirrored, heating_distance(law, terms, *at))
    for placed in terms.places:
        z = placed.place_on(branch.cooling, z)
    share = _or_none(law.shape.martensite_left(z))
    return fraction_on(state, branch, *law.renewal.curves(state, *_shares(law, terms, state), share, share))


def open_branches(law: Kinetics, terms: KineticsTerms, state: WireState) -> Branch:
    """Branches whose range the wire is in (or before) at `state`: one that is behind it transforms nothing any more."""
    if terms.shape_branches:
        h, k = _shares(law, terms, state)
        return Branch(h > 0.0, k > 0.0)
    at = state.temperature, state.stress, over(state, 0.0)
    left = law.shape.anything_left
    heated, cooled = heating_distance(law, terms, *at), cooling_distance(law, terms, *at)
    for placed in terms.places:
        heated, cooled = placed.heating_place(heated), placed.cooling_place(cooled)
    return Branch(left(heated), left(1.0 - cooled))


def _tightening(
    law: Kinetics, terms: KineticsTerms, state: WireState, temperature: Scalar, stress: Scalar
) -> tuple[Scalar, Scalar]:
    """Change of stress of a step as the directions of heating and of cooling see it, Pa.

    Where an effect moves a range, the stress that would have moved it as far: the enhanced conditions ask whether the
    wire goes through the range, not why.
    """
    tighter = stress - state.stress
    if not terms.ranges:
        return tighter, tighter
    warmer = temperature - state.temperature
    new, old = (temperature, stress, state), (state.temperature, state.stress, over(state, 0.0))
    heated = heating_width(law) * (heating_distance(law, terms, *new) - heating_distance(law, terms, *old))
    cooled = cooling_width(law) * (cooling_distance(law, terms, *new) - cooling_distance(law, terms, *old))
    return (warmer - heated) * law.stress_slope_austenite, (warmer - cooled) * law.stress_slope_martensite


def choose_branch(
    law: Kinetics,
    terms: KineticsTerms,
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
    tighter, tighter_cooling = _tightening(law, terms, state, temperature, stress)
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


def with_amplitudes(law: Kinetics, terms: KineticsTerms, old: WireState, branch: Branch, new: WireState) -> WireState:
    """`new`, the end of a step from `old` on `branch`, with the amplitudes of its branches brought up to date."""
    at = new.temperature, new.stress, old
    h, k = martensite_left(law, terms, *at), austenite_left(law, terms, *at)
    amplitudes = law.renewal.renewed(old, branch.heating, branch.cooling, h, k, new.martensite_fraction)
    by_loading = (new.stress - old.stress) / law.stress_slope_martensite > old.temperature - new.temperature
    return dataclasses.replace(
        new,
        xi_M=amplitudes.xi_M,
        xi_A=amplitudes.xi_A,
        heating_missed=amplitudes.heating_missed,
        cooling_missed=amplitudes.cooling_missed,
        formed_by_loading=jnp.where(branch.cooling, 1.0 * by_loading, old.formed_by_loading),
    )
