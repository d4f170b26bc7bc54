"""The parameters' posterior distribution by Markov chains; standard errors describe it where the problem is nearly linear.

Random-walk Metropolis in coordinates in which the Gaussian of the fit is round. Needs the optional extra `bayes`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.core.extras import MissingExtraError, optional_package
from smajax.core.progress import Progress, Stage, quiet
from smajax.core.result_cache import ResultCache
from smajax.fit.problem import Problem

CHAINS = 8
WIDER = 2.0  # standard deviations of the starts over the posterior's: R-hat needs starts wider than it
STEP = 2.38  # size of a proposal, over the root of the number of parameters (Roberts, Gelman and Gilks 1997)
BLOCK = 25  # proposals between two progress events
WARM_UP = 0.3  # share of each chain that is discarded
MIXED = 1.02  # R-hat up to which chains count as one distribution
ENOUGH = 200  # independent draws for a mean and an interval


@dataclass(frozen=True)
class Posterior:
    """Draws of the parameters `names`, SI: (chains, draws, K). r_hat, effective: of each parameter."""

    names: tuple[str, ...]
    draws: np.ndarray
    r_hat: np.ndarray
    effective: np.ndarray  # independent draws
    accepted: float  # share of the proposals
    inflation: (
        float  # the data are weighted by one over this: autocorrelation of the residual, and noise unlike the declared
    )

    @property
    def flat(self) -> np.ndarray:
        """All draws, (chains * draws, K)."""
        return self.draws.reshape(-1, len(self.names))

    @property
    def converged(self) -> bool:
        """Whether the chains agree and hold enough independent draws."""
        return bool(self.r_hat.max() <= MIXED and self.effective.min() >= ENOUGH)


@dataclass(frozen=True)
class ChainSettings:
    """`draws`: of each chain, after the warm-up."""

    draws: int
    seed: int = 0
    cache: ResultCache = field(default_factory=ResultCache)
    progress: Progress = quiet


@eqx.filter_jit
def _advance(
    problem: Problem, target: dict[str, jax.Array], start: jax.Array, keys: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """(positions in whitened coordinates, accepted or not) after each proposal; `keys` is (proposals, chains).

    The density at the start is computed again, so that a resumed chain is the same chain.
    """
    blackjax = library()

    def log_density(z: jax.Array) -> jax.Array:
        chosen = target["centre"] + target["factor"] @ z
        inside = jnp.all((chosen >= target["low"]) & (chosen <= target["high"]))
        values = target["values"].at[target["slots"]].set(jnp.clip(chosen, target["low"], target["high"]))
        data = problem.misfit(values) / problem.noise
        density = -0.5 * (jnp.sum(data**2) / target["inflation"] + jnp.sum(problem.priors.rows(values) ** 2))
        return jnp.where(inside & jnp.isfinite(density), density, -jnp.inf)

    size = target["centre"].shape[0]
    proposal = blackjax.additive_step_random_walk.normal_random_walk(log_density, STEP / np.sqrt(size) * jnp.ones(size))

    def one(states: Any, keys: jax.Array) -> tuple[Any, tuple[jax.Array, jax.Array]]:
        new, info = jax.vmap(proposal.step)(keys, states)
        return new, (new.position, info.is_accepted)

    return jax.lax.scan(one, jax.vmap(proposal.init)(start), keys)[1]


def library() -> Any:
    """blackjax. ValueError says how to install it."""
    try:
        return optional_package("blackjax", "bayes", "a posterior")
    except MissingExtraError as error:
        raise ValueError(str(error)) from None


def posterior(
    problem: Problem,
    values: np.ndarray,
    names: Sequence[str],
    covariance: np.ndarray,
    bounds: Mapping[str, tuple[float, float]],
    inflation: float,
    settings: ChainSettings,
) -> Posterior:
    """Draws of `names` around the fit `values` (P,), the others fixed there; uniform within `bounds` but for the priors.

    `covariance`: Gaussian, that of the fit; `inflation`: variance of an independent sample over the
    noise's. Raises ValueError without blackjax.
    """
    blackjax = library()
    cache, draws = settings.cache, settings.draws
    index = [problem.names.index(name) for name in names]
    low, high = np.asarray([bounds[name] for name in names]).T
    scale = np.sqrt(np.diag(covariance))
    factor = scale[:, None] * np.linalg.cholesky(covariance / np.outer(scale, scale) + 1e-10 * np.eye(len(names)))
    target = {
        "centre": jnp.asarray(values[index]),
        "factor": jnp.asarray(factor),
        "low": jnp.asarray(low),
        "high": jnp.asarray(high),
        "values": jnp.asarray(values),
        "slots": jnp.asarray(index),
        "inflation": jnp.asarray(inflation),
    }
    key = cache.key((problem, target), "posterior", draws, settings.seed, CHAINS)
    begin, walk = jax.random.split(jax.random.key(settings.seed))
    far = WIDER * np.asarray(jax.random.normal(begin, (CHAINS, len(names))))
    inside = np.clip(values[index] + far @ factor.T, low + 0.01 * (high - low), high - 0.01 * (high - low))
    here = np.linalg.solve(factor, (inside - values[index]).T).T
    blocks = -(-int(np.ceil(draws / (1.0 - WARM_UP))) // BLOCK)
    positions, accepted = np.zeros((0, CHAINS, len(names))), np.zeros((0, CHAINS), bool)
    cached = cache.load(key)
    if cached is not None:
        positions, accepted = cached["positions"], cached["accepted"]
        here = positions[-1]
    for block in range(len(positions) // BLOCK, blocks):
        settings.progress(Stage("drawing from the posterior", block / blocks))
        keys = jax.random.split(jax.random.fold_in(walk, block), (BLOCK, CHAINS))
        new, moved = _advance(problem, target, jnp.asarray(here), keys)
        here = np.asarray(new[-1])
        positions, accepted = np.concatenate([positions, new]), np.concatenate([accepted, moved])
        cache.save(key, {"positions": positions, "accepted": accepted}, last=block == blocks - 1)
    settings.progress(Stage("drawing from the posterior", 1.0))
    whole = np.swapaxes(positions[-draws:], 0, 1)
    samples = values[index] + whole @ factor.T
    half = draws // 2
    split = jnp.asarray(np.concatenate([samples[:, :half], samples[:, half : 2 * half]]))  # a drift shows as two chains
    return Posterior(
        tuple(names),
        samples,
        np.asarray(blackjax.diagnostics.potential_scale_reduction(split)).reshape(-1),
        np.asarray(blackjax.diagnostics.effective_sample_size(jnp.asarray(samples))).reshape(-1),
        float(accepted[-draws:].mean()),
        inflation,
    )
