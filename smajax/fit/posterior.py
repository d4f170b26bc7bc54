"""The parameters' distribution itself by Markov chains: what standard errors say where the problem is nearly linear.

Random-walk Metropolis in coordinates in which the Gaussian of the fit is round. Needs the optional extra `bayes`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.core.progress import Progress, Stage, quiet
from smajax.core.result_cache import Kept
from smajax.fit.problem import Problem

CHAINS = 8
WIDER = (
    2.0  # standard deviations from the fit that chains start at, over the posterior's: wider than it, as R-hat wants
)
STEP = 2.38  # of a jump, over the root of the number of parameters (Roberts, Gelman and Gilks 1997)
BLOCK = 25  # jumps between two words of progress
DROPPED = 0.3  # of each chain, on its way in from where it started
MIXED = 1.02  # R-hat up to which chains count as one distribution
ENOUGH = 200  # independent draws for a mean and an interval


@dataclass(frozen=True)
class Posterior:
    """Draws of the parameters `names`, SI: (chains, draws, K). r_hat, effective: of each parameter."""

    names: tuple[str, ...]
    draws: np.ndarray
    r_hat: np.ndarray
    effective: np.ndarray  # independent draws
    accepted: float  # share of the jumps
    inflation: float  # the data count by one over this: memory in the residual, and noise that is not what was said

    @property
    def flat(self) -> np.ndarray:
        """All draws, (chains * draws, K)."""
        return self.draws.reshape(-1, len(self.names))

    @property
    def converged(self) -> bool:
        """Whether the chains agree and hold enough independent draws."""
        return bool(self.r_hat.max() <= MIXED and self.effective.min() >= ENOUGH)


@eqx.filter_jit
def _advance(
    problem: Problem, given: dict[str, jax.Array], start: jax.Array, keys: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """(places in whitened coordinates, taken or not) after each of as many jumps as `keys` (jumps, chains) has.

    The density where the chains start is formed again, so that a resumed chain is the same chain.
    """
    blackjax = library()

    def density(z: jax.Array) -> jax.Array:
        chosen = given["centre"] + given["factor"] @ z
        inside = jnp.all((chosen >= given["low"]) & (chosen <= given["high"]))
        values = given["values"].at[given["slots"]].set(jnp.clip(chosen, given["low"], given["high"]))
        data = problem.misfit(values) / problem.noise
        told = -0.5 * (jnp.sum(data**2) / given["inflation"] + jnp.sum(problem.priors.rows(values) ** 2))
        return jnp.where(inside & jnp.isfinite(told), told, -jnp.inf)

    size = given["centre"].shape[0]
    jump = blackjax.additive_step_random_walk.normal_random_walk(density, STEP / np.sqrt(size) * jnp.ones(size))

    def one(states: Any, keys: jax.Array) -> tuple[Any, tuple[jax.Array, jax.Array]]:
        new, info = jax.vmap(jump.step)(keys, states)
        return new, (new.position, info.is_accepted)

    return jax.lax.scan(one, jax.vmap(jump.init)(start), keys)[1]


def library() -> Any:
    """blackjax. ValueError says how to install it."""
    try:
        import blackjax
    except ImportError:
        raise ValueError(
            "a posterior needs the optional extra `bayes`: pip install 'smajax[bayes]' (or pip install blackjax)."
        ) from None
    return blackjax


def posterior(
    problem: Problem,
    values: np.ndarray,
    names: Sequence[str],
    covariance: np.ndarray,
    bounds: Mapping[str, tuple[float, float]],
    inflation: float,
    draws: int,
    *,
    seed: int = 0,
    kept: Kept | None = None,
    progress: Progress = quiet,
) -> Posterior:
    """Draws of `names` around the fit `values` (P,), the others held there; even within `bounds` but for the priors.

    `covariance`: Gaussian, that of the fit; `inflation`: variance of an independent sample over the noise's; `draws`: of
    each chain, kept ones. Raises ValueError without blackjax.
    """
    blackjax = library()
    kept = kept or Kept()
    index = [problem.names.index(name) for name in names]
    low, high = np.asarray([bounds[name] for name in names]).T
    scale = np.sqrt(np.diag(covariance))
    factor = scale[:, None] * np.linalg.cholesky(covariance / np.outer(scale, scale) + 1e-10 * np.eye(len(names)))
    given = {
        "centre": jnp.asarray(values[index]),
        "factor": jnp.asarray(factor),
        "low": jnp.asarray(low),
        "high": jnp.asarray(high),
        "values": jnp.asarray(values),
        "slots": jnp.asarray(index),
        "inflation": jnp.asarray(inflation),
    }
    key = kept.key((problem, given), "posterior", draws, seed, CHAINS)
    begin, walk = jax.random.split(jax.random.key(seed))
    far = WIDER * np.asarray(jax.random.normal(begin, (CHAINS, len(names))))
    inside = np.clip(values[index] + far @ factor.T, low + 0.01 * (high - low), high - 0.01 * (high - low))
    here = np.linalg.solve(factor, (inside - values[index]).T).T
    blocks = -(-int(np.ceil(draws / (1.0 - DROPPED))) // BLOCK)
    places, accepted = np.zeros((0, CHAINS, len(names))), np.zeros((0, CHAINS), bool)
    known = kept.load(key)
    if known is not None:
        places, accepted = known["places"], known["accepted"]
        here = places[-1]
    for block in range(len(places) // BLOCK, blocks):
        progress(Stage("drawing from the posterior", block / blocks))
        keys = jax.random.split(jax.random.fold_in(walk, block), (BLOCK, CHAINS))
        new, taken = _advance(problem, given, jnp.asarray(here), keys)
        here = np.asarray(new[-1])
        places, accepted = np.concatenate([places, new]), np.concatenate([accepted, taken])
        kept.save(key, {"places": places, "accepted": accepted}, last=block == blocks - 1)
    progress(Stage("drawing from the posterior", 1.0))
    whole = np.swapaxes(places[-draws:], 0, 1)
    found = values[index] + whole @ factor.T
    half = draws // 2
    split = jnp.asarray(np.concatenate([found[:, :half], found[:, half : 2 * half]]))  # a drift shows as two chains
    return Posterior(
        tuple(names),
        found,
        np.asarray(blackjax.diagnostics.potential_scale_reduction(split)).reshape(-1),
        np.asarray(blackjax.diagnostics.effective_sample_size(jnp.asarray(found))).reshape(-1),
        float(accepted[-draws:].mean()),
        inflation,
    )
