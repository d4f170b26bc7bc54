"""Coupon: a wire whose temperature and stress are prescribed, in a testing machine with an oven."""

from __future__ import annotations

from typing import ClassVar

import equinox as eqx


class Coupon(eqx.Module):
    """No heat balance and no motion: the inputs are the temperature (C) and the stress (Pa), the reading is strain."""

    inputs_required: ClassVar[frozenset[str]] = frozenset({"temperature", "stress"})
    inputs_optional: ClassVar[frozenset[str]] = frozenset()
    # Measured at an instant, as the strain is; the inputs of other loads are commands that hold over a step.
    inputs_sampled: ClassVar[frozenset[str]] = inputs_required
    reading: ClassVar[tuple[str, str]] = ("strain", "-")
