"""What is known of the fitted values of a model, as the NetCDF file beside its text."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from smajax.data.experiment.record import Prior
from smajax.data.model_file.edits import as_written
from smajax.data.model_file.record import LikelyModel, ModelRecord
from smajax.data.model_file.schema import FORMAT

if TYPE_CHECKING:
    import xarray as xr  # in half a second, where a file is written or read

ERRORS = (
    "A value that each run has its own of is the mean over the fit runs; its variance is what these values scatter by, and it is taken as "
    "uncorrelated with all others."
)


def uncertainty_of(model: ModelRecord) -> xr.Dataset:
    """What is known of the fitted values of each likely model: `value_0`, `covariance_0`, ... along `parameter_0`."""
    import xarray as xr

    result = xr.Dataset(attrs={"title": model.title, "format": FORMAT, "unit": "SI, degC, rad", "errors": ERRORS})
    # Of a model that was read and is saved again: what was changed by hand in between stays said.
    result.attrs["written"] = model.as_fitted or as_written(model)
    for number, one in enumerate(model.likely):
        result.attrs[f"effects_{number}"] = " ".join(one.effects)
        if one.values:
            result = result.merge(_dataset(one, str(number)))
    return result


def _dataset(one: LikelyModel, number: str) -> xr.Dataset:
    import xarray as xr

    every, known = f"parameter_{number}", f"determined_{number}"
    names = list(one.values)
    priors = [one.priors.get(name) for name in names]
    columns = {
        f"value_{number}": [one.values[name] for name in names],
        f"prior_mean_{number}": [np.nan if prior is None else prior.mean for prior in priors],
        f"prior_sigma_{number}": [np.nan if prior is None else prior.sigma for prior in priors],
        f"prior_logarithmic_{number}": [0.0 if prior is None else float(prior.logarithmic) for prior in priors],
    }
    result = xr.Dataset(
        {name: ((every,), np.asarray(column, dtype=float)) for name, column in columns.items()}, coords={every: names}
    )
    if one.names:
        covariance = ((known, f"{known}_too"), np.asarray(one.covariance, dtype=float))
        result = result.assign({f"covariance_{number}": covariance}).assign_coords({known: list(one.names)})
    return result


class Uncertainty(NamedTuple):
    """What a NetCDF file holds: the likely models, without their probabilities, and what the text said (`edits.as_written`)."""

    likely: list[LikelyModel]
    written: str


def read_uncertainty(content: bytes) -> Uncertainty:
    """Raises ValueError for what `uncertainty_of` did not write."""
    import xarray as xr

    try:
        with xr.open_dataset(BytesIO(content), engine="scipy") as dataset:
            dataset.load()
        count = sum(str(name).startswith("effects_") for name in dataset.attrs)
        return Uncertainty([_likely(dataset, number) for number in range(count)], str(dataset.attrs.get("written", "")))
    except (KeyError, ValueError, TypeError, OSError, AssertionError) as error:
        raise ValueError(str(error)) from None


def _likely(dataset: xr.Dataset, number: int) -> LikelyModel:
    effects, probability = tuple(str(dataset.attrs[f"effects_{number}"]).split()), 1.0
    if f"value_{number}" not in dataset:
        return LikelyModel(effects, probability, {})
    names = [str(one) for one in dataset[f"parameter_{number}"].values]
    columns = {
        key: np.asarray(dataset[f"{key}_{number}"].values, dtype=float)
        for key in ("value", "prior_mean", "prior_sigma", "prior_logarithmic")
    }
    priors = {
        name: Prior(float(mean), float(sigma), bool(logarithmic))
        for name, mean, sigma, logarithmic in zip(
            names, columns["prior_mean"], columns["prior_sigma"], columns["prior_logarithmic"], strict=True
        )
        if np.isfinite(mean)
    }
    values = dict(zip(names, columns["value"].tolist(), strict=True))
    if f"covariance_{number}" not in dataset:
        return LikelyModel(effects, probability, values, priors=priors)
    known = tuple(str(one) for one in dataset[f"determined_{number}"].values)
    covariance = np.asarray(dataset[f"covariance_{number}"].values, dtype=float)
    if covariance.shape != (len(known),) * 2 or not np.isfinite(covariance).all() or not set(known) <= set(values):
        raise ValueError(f"covariance_{number} does not go with its names")
    return LikelyModel(effects, probability, values, known, covariance, priors)
