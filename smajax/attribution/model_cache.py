"""A fitted model and its evidence, cached: a search that resumes needs no program for what it has fitted before."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.laplace_evidence import FittedModel, fitted_model
from smajax.core.result_cache import ResultCache

ARRAYS = ("values", "scales", "gram", "precision", "residual")
NUMBERS = ("squares", "log_prior", "rms", "correlation")


def cached_model(
    joint: JointParameters, effects: tuple[str, ...], values: np.ndarray, program: Sequence[str], cache: ResultCache
) -> FittedModel:
    """`fitted_model`, or what is cached of it, to the last bit."""
    key = cache.key(joint.problem, "fitted model", *joint.described, effects, tuple(program), np.asarray(values))
    record = cache.load(key, counted=False)
    if record is not None:
        return _model(record)
    model = fitted_model(joint, effects, values, program)
    words = {
        "effects": model.effects,
        "names": model.names,
        "width_factors": model.width_factors,
        "one_sided": model.one_sided,
        **{name: float(getattr(model, name)) for name in NUMBERS},
    }
    cache.save(key, {**{name: getattr(model, name) for name in ARRAYS}, "words": np.asarray(json.dumps(words))})
    return model


def _model(record: Mapping[str, np.ndarray]) -> FittedModel:
    words = json.loads(str(record["words"]))
    found: dict[str, Any] = {**{name: record[name] for name in ARRAYS}, **{name: words[name] for name in NUMBERS}}
    return FittedModel(
        effects=tuple(words["effects"]),
        names=tuple(words["names"]),
        width_factors=words["width_factors"],
        one_sided=tuple((place, widths) for place, widths in words["one_sided"]),
        **found,
    )
