"""The plants of a sweep or a tuning: mismatches of a plant, or a batch of plants such as draws from a posterior."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import jax
import numpy as np
from numpy.typing import ArrayLike

from smajax.control.mismatch import MISMATCHES, mismatches_of
from smajax.control.perturbed_plant import OF_ARM, Perturbation
from smajax.control.position_unit import DEGREES, PositionUnit, unit_of
from smajax.core.names import of_many
from smajax.core.parameters import check_bounds, get_parameters, parameters, set_parameters
from smajax.model.effects.library import LIBRARY
from smajax.model.extended import with_effects
from smajax.model.system import System

# A batch of plants: parameter -> its value in each, SI; or systems of one kind, in a list or stacked (leaves of shape (plants, ...)).
Plants = Mapping[str, ArrayLike] | Sequence[System] | System


@dataclass(frozen=True)
class PlantSet:
    """What differs between the plants of closed loops, a column each; of a batch its plants. By default the arm's mismatches."""

    perturbation: Perturbation = OF_ARM
    unit: PositionUnit = DEGREES
    # (columns,), the plant as its controller assumes it.
    nominal: np.ndarray = field(default_factory=lambda: np.ones(len(MISMATCHES)))
    batch: np.ndarray | None = None  # (plants, columns), SI
    units: tuple[str, ...] = ()  # of the columns of a batch

    @property
    def columns(self) -> tuple[str, ...]:
        return self.perturbation.columns

    @property
    def marks(self) -> list[str | np.ndarray]:
        """What tells one batch from another, for `provenance.digest`."""
        return [] if self.batch is None else [*self.columns, self.batch]

    @property
    def table(self) -> dict[str, str]:
        """Mismatch -> parameter."""
        return dict(zip(self.columns, self.perturbation.parameters, strict=True))


def carrying(system: System, plants: Plants | None) -> System:
    """`system` with the effects of a batch of plants that it lacks, at base value: its runs are the same."""
    if plants is None:
        return system
    if isinstance(plants, Mapping):
        named = dict.fromkeys(name.split(".")[0] for name in plants if "." in name)
    else:
        first = plants if isinstance(plants, System) else next(iter(plants), system)
        named = dict.fromkeys(one.effect_name for one in first.effects)
    return with_effects(system, [name for name in named if name in LIBRARY])


def plant_set(system: System, plants: Plants | None = None, asked: Sequence[str] = ()) -> PlantSet:
    """The mismatches of a plant (with those that are `asked`, `mismatches_of`), or a batch of plants in their place, which may have effects that the system lacks (`carrying`).

    Raises ValueError for a batch that has no plant, parameters that the system has not, values out of their bounds, lists of
    different lengths, and systems that differ in more than their parameters.
    """
    unit, system = unit_of(system), carrying(system, plants)
    if plants is None:
        mismatches = mismatches_of(system, asked)
        return PlantSet(Perturbation(tuple(mismatches), tuple(mismatches.values())), unit, np.ones(len(mismatches)))
    values = _values(system, plants)
    names = tuple(values)
    batch = np.stack([values[name] for name in names], axis=1)
    check_bounds(set_parameters(system, values))
    nominal = np.asarray(get_parameters(system, names), dtype=float)
    table = parameters(system)
    return PlantSet(
        Perturbation(names, names, absolute=True), unit, nominal, batch, tuple(table[name].unit for name in names)
    )


def _values(system: System, plants: Plants) -> dict[str, np.ndarray]:
    """Parameter -> (plants,)."""
    named = dict(plants) if isinstance(plants, Mapping) else _differing(system, plants)
    table = parameters(system)
    for name in named:
        if name not in table:
            lists = "a batch of plants names parameters of the system"
            raise ValueError(f"no parameter {name!r}{of_many(name, table, lists)}")
    result = {name: np.atleast_1d(np.asarray(values, dtype=float)) for name, values in named.items()}
    shapes = {name: values.shape for name, values in result.items()}
    if len(set(shapes.values())) != 1 or any(len(shape) != 1 or shape[0] < 1 for shape in shapes.values()):
        raise ValueError(
            f"a batch of plants has one value a plant of each parameter, (plants,), at least one; got {shapes or 'no parameter'}."
        )
    return result


def _differing(system: System, plants: Sequence[System] | System) -> dict[str, np.ndarray]:
    """Those parameters that are not the same in all plants and the system."""
    several: list[System] = [plants] if isinstance(plants, System) else list(plants)
    alike: Any = jax.tree.structure(system)
    for number, one in enumerate(several):
        if jax.tree.structure(one) != alike:
            raise ValueError(
                f"plant {number} of the batch has other parts than the system (wire law, load, drive, effects): expected plants that "
                "differ in their parameters."
            )
    if not several:
        raise ValueError("a batch of plants has at least one.")
    names = list(parameters(system))
    own = dict(zip(names, np.asarray(get_parameters(system, names), dtype=float), strict=True))
    if isinstance(plants, System):
        # A leaf that is the same in all plants may be stacked or not.
        columns = {name: np.ravel(np.asarray(get_parameters(plants, [name])[0], dtype=float)) for name in names}
    else:
        rows = np.stack([np.asarray(get_parameters(one, names), dtype=float) for one in several])
        columns = dict(zip(names, rows.T, strict=True))
    count = max(len(column) for column in columns.values())
    values = {name: np.broadcast_to(column, count) for name, column in columns.items() if (column != own[name]).any()}
    return values or {names[0]: np.full(count, own[names[0]])}
