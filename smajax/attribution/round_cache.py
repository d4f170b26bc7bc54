"""What a round of the search fits, cached: a search that was interrupted comes to where it was without the linear model of each round."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.laplace_evidence import FittedModel
from smajax.attribution.program_fits import BegunFit
from smajax.attribution.traces import Traces
from smajax.core.result_cache import ResultCache


class Asked(NamedTuple):
    """The sets that a round fits, where their fits begin, and what the search knows by then."""

    sets: tuple[tuple[str, ...], ...]
    begun: tuple[BegunFit, ...]
    detectable: tuple[str, ...]  # effects that the runs can show
    programs: tuple[tuple[str, ...], ...]  # effects that each program of the fits so far carries
    traced: tuple[tuple[str, ...], ...]  # and each of the linear models so far
    traces: Callable[[], Traces]  # of the linear model, where it is asked for again


def key_of_round(search: JointSearch, present: FittedModel, error: float, *settings: object) -> str:
    """Of all that the linear model at `present` and the choice of sets in it depend on."""
    cache, joint = search.settings.cache, search.joint
    if cache.folder is None:
        return ""
    of_search = (
        search.extent,
        search.noise,
        sorted(search.excluded),
        search.detectable,
        search.programs,
        search.traced,
        list(search.fitted),
        search.trials,
    )
    of_present = present.effects, present.width_factors, np.asarray(present.values), np.asarray(present.residual)
    # Fits begin at what other models have as well (`set_starts.as_fitted_before`).
    fitted = np.asarray([model.values for model in search.fitted.values()])
    return cache.key(joint.problem, "round", *joint.described, *of_search, *of_present, fitted, float(error), *settings)


def loaded_round(cache: ResultCache, key: str, traces: Callable[[], Traces]) -> Asked | None:
    """What was saved under `key`; None on a miss. `traces`: which are not in it, should they be asked for."""
    record = cache.load(key, counted=False)
    if record is None:
        return None
    words = json.loads(str(record["words"]))
    begun = [
        BegunFit(tuple(effects), values, factors)
        for (effects, factors), values in zip(words["begun"], record["values"], strict=True)
    ]

    def sets(named: list[list[str]]) -> tuple[tuple[str, ...], ...]:
        return tuple(map(tuple, named))

    programs = sets(words["programs"]), sets(words["traced"])
    return Asked(sets(words["sets"]), tuple(begun), tuple(words["detectable"]), *programs, traces)


def save_round(cache: ResultCache, key: str, asked: Asked) -> None:
    """Numbers as they are, to the last bit."""
    words = {
        "sets": asked.sets,
        "begun": [(one.effects, dict(one.width_factors)) for one in asked.begun],
        "detectable": asked.detectable,
        "programs": asked.programs,
        "traced": asked.traced,
    }
    values = np.asarray([one.values for one in asked.begun])
    cache.save(key, {"words": np.asarray(json.dumps(words)), "values": values})
