"""jax-sysid from command to reading, no physics: `python -m studies.attribution_benchmark.peers.sysid_peer FILE`.

Runs in an environment of its own with numpy and jax-sysid, from the folder that has `studies`; prints JSON.

State-space models as its documentation builds them: linear, and the residual recurrent network with a hidden layer each
for state and output, on scaled signals, Adam and then L-BFGS, one initial state a run. Which of them is chosen by leaving
each fit run out in turn; the one chosen is fitted to all fit runs from several seeds, and the best of these kept. The
initial state of a run that was not fitted is learnt from its readings (`learn_x0`), as documented.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from studies.attribution_benchmark.peers.given import Given, error, load

ADAM, LBFGS = 1000, 1000  # steps, as in the documentation's examples
SEEDS = 2
RHO_STATE, RHO = 1e-4, 1e-4  # of the documentation's recurrent network


@dataclass(frozen=True)
class Setting:
    """What cross-validation chooses; without neurons a model is linear."""

    states: int
    neurons: int
    rho: float = RHO


SETTINGS = (Setting(4, 0), Setting(3, 8), Setting(6, 8, 1e-2 * RHO))


@dataclass(frozen=True)
class Data:
    """Scaled inputs (n, U) and readings (n, 1), run by run; by which a scaled reading is one in noises."""

    inputs: list[np.ndarray]
    readings: list[np.ndarray]
    spread: float


def data_of(given: Given) -> Data:
    """Scaled by mean and deviation of the fit runs."""
    inputs = [np.stack(list(run.inputs.values()), axis=1) for run in given.runs]
    readings = [run.reading[:, None] for run in given.runs]
    fitted = [k for k, run in enumerate(given.runs) if run.fitted]

    def scaled(series: list[np.ndarray]) -> tuple[list[np.ndarray], np.ndarray]:
        known = np.concatenate([series[k] for k in fitted])
        spread = np.where(known.std(axis=0) > 0.0, known.std(axis=0), 1.0)
        return [(one - known.mean(axis=0)) / spread for one in series], spread

    told, (shown, spread) = scaled(inputs)[0], scaled(readings)
    return Data(told, shown, float(spread[0]))


def _network(setting: Setting, channels: int, seed: int) -> Any:
    """x+ = A x + B u + W3 s(W1 x + W2 u + b1) + b2, y = C x + D u + W6 s(W4 x + W5 u + b3) + b4."""
    import jax
    import jax.numpy as jnp
    from jax_sysid.models import Model

    def sigmoid(x: Any) -> Any:
        return 1.0 / (1.0 + jnp.exp(-x))

    @jax.jit
    def ahead(x: Any, u: Any, params: Any) -> Any:
        a, b, w1, w2, w3, b1, b2 = params[:7]
        return a @ x + b @ u + w3 @ sigmoid(w1 @ x + w2 @ u + b1) + b2

    @jax.jit
    def shown(x: Any, u: Any, params: Any) -> Any:
        c, d, w4, w5, w6, b3, b4 = params[7:]
        return c @ x + d @ u + w6 @ sigmoid(w4 @ x + w5 @ u + b3) + b4

    random, nx, h = np.random.default_rng(seed), setting.states, setting.neurons
    model = Model(nx, 1, channels, state_fcn=ahead, output_fcn=shown)
    state = [0.5 * np.eye(nx), 0.1 * random.standard_normal((nx, channels)), 0.1 * random.standard_normal((h, nx))]
    state += [0.5 * random.standard_normal((h, channels)), 0.5 * random.standard_normal((nx, h)), np.zeros(h)]
    output = [0.1 * random.standard_normal((1, nx)), np.zeros((1, channels)), 0.5 * random.standard_normal((h, nx))]
    output += [0.5 * random.standard_normal((h, channels)), 0.5 * random.standard_normal((1, h)), np.zeros(h)]
    model.init(params=[*state, np.zeros(nx), *output, np.zeros(1)])
    return model


def fitted(setting: Setting, data: Data, runs: Sequence[int], seed: int) -> Any:
    """A model of `runs`."""
    from jax_sysid.models import LinearModel

    channels = data.inputs[0].shape[1]
    if setting.neurons:
        model = _network(setting, channels, seed)
    else:
        model = LinearModel(setting.states, 1, channels, feedthrough=True)
        model.init(seed=seed)
    model.loss(rho_x0=RHO_STATE, rho_th=setting.rho)
    model.optimization(adam_epochs=ADAM if setting.neurons else 0, lbfgs_epochs=LBFGS, iprint=-1)
    model.fit([data.readings[k] for k in runs], [data.inputs[k] for k in runs])
    return model


def off(model: Any, data: Data, runs: Sequence[int]) -> float:
    """Rms error of `runs` over the noise, their initial states learnt from their readings; infinite where it runs away."""
    pairs = []
    for run in runs:
        start = model.learn_x0(data.inputs[run], data.readings[run], verbosity=False)
        found = np.asarray(model.predict(start, data.inputs[run])[0]).reshape(-1)
        if not np.isfinite(found).all():
            return float("inf")
        pairs.append((data.spread * data.readings[run][:, 0], data.spread * found))
    return error(pairs)


def run(given: Given, settings: Sequence[Setting] = SETTINGS) -> dict[str, Any]:
    """What is printed."""
    from importlib.metadata import version

    data = data_of(given)
    fit, unseen = ([k for k, one in enumerate(given.runs) if one.fitted is role] for role in (True, False))
    scores = {}
    for setting in settings:
        each = [off(fitted(setting, data, [k for k in fit if k != out], 0), data, [out]) for out in fit]
        scores[setting] = float(np.sqrt(np.mean(np.square(each))))
    best = min(scores, key=lambda one: scores[one])
    models = [fitted(best, data, fit, seed) for seed in range(SEEDS if best.neurons else 1)]
    model = min(models, key=lambda one: off(one, data, fit))
    kind = f"network of {best.neurons} and {best.neurons} neurons" if best.neurons else "linear"
    return {
        "version": version("jax-sysid"),
        "fit_error": off(model, data, fit),
        "held_out_error": off(model, data, unseen),
        "said": f"{kind}, {best.states} states, ridge {best.rho:g}; runs left out {scores[best]:.3g}",
    }


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("file", type=Path)
    asked.add_argument("--linear", action="store_true", help="linear models only")
    options = asked.parse_args()
    import jax

    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_platforms", "cpu")
    with contextlib.redirect_stdout(io.StringIO()):  # it reports its progress there
        found = run(load(options.file), [one for one in SETTINGS if not (options.linear and one.neurons)])
    print(json.dumps(found))


if __name__ == "__main__":
    main()
