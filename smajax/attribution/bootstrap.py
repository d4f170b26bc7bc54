"""How far an estimate depends on which runs there happened to be: fits to runs drawn anew, with replacement."""

from __future__ import annotations

import numpy as np

from smajax.attribution.cross_validation import Fitted, Model, Search, Start


def bootstrap_intervals(setting: Search, model: Model, seed: int) -> dict[str, tuple[float, float]]:
    """Where the middle 95 % of fits to runs drawn with replacement lie, of every free parameter.

    Empty for fewer than 3 runs, and for the base model: the intervals are those of what was added.

    The fits are tied to `model` as those with a run left out are (`Search.cross_validated`). With few runs the interval is
    coarse, and holds the truth less often than that: three runs can be drawn in ten ways.
    """
    count, config = setting.problem.batch.runs, setting.config
    names = setting.free(model.effects)
    if count < config.bootstrap_least_runs or not model.effects:
        return {}
    drawn = np.random.default_rng(seed).multinomial(count, np.full(count, 1.0 / count), config.bootstrap_draws)
    level = setting.levels([Fitted(model.effects, setting.known(model))])[0]
    ways, again = np.unique(drawn, axis=0, return_inverse=True)
    starts = [Start(model.effects, model.values, way.astype(float), np.sqrt(level) / config.fold_tie) for way in ways]
    fits, _ = setting.fit(starts, "runs drawn anew")
    place = setting.problem.names.index
    values = np.stack([[one.values[place(name)] for name in names] for one in fits])[np.ravel(again)]
    low, high = np.percentile(values, config.bootstrap_interval, axis=0)
    return {name: (float(a), float(b)) for name, a, b in zip(names, low, high, strict=True)}
