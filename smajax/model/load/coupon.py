"""Coupons: a wire in a testing machine with an oven, its temperature and its stress or strain prescribed."""

from __future__ import annotations

from typing import ClassVar

import equinox as eqx


class AbstractCoupon(eqx.Module):
    """No heat balance and no motion: every input is measured at an instant, as the reading is.

    The inputs of other loads are commands that hold over a step.
    """

    inputs_required: ClassVar[frozenset[str]]
    inputs_optional: ClassVar[frozenset[str]] = frozenset()
    reading: ClassVar[tuple[str, str]]


class Coupon(AbstractCoupon):
    """Prescribed temperature (C) and stress (Pa); the reading is the strain."""

    inputs_required: ClassVar[frozenset[str]] = frozenset({"temperature", "stress"})
    reading: ClassVar[tuple[str, str]] = ("strain", "-")


class StrainCoupon(AbstractCoupon):
    """Prescribed temperature (C) and strain; the reading is the stress. The wire is unloaded at the first sample."""

    inputs_required: ClassVar[frozenset[str]] = frozenset({"temperature", "strain"})
    reading: ClassVar[tuple[str, str]] = ("stress", "Pa")
