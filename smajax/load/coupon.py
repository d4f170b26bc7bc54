"""Coupon: a wire whose temperature and stress are prescribed, in a testing machine with an oven."""

from __future__ import annotations

from typing import ClassVar

import equinox as eqx


class Coupon(eqx.Module):
    """No heat balance and no motion: the inputs are the temperature (C) and the stress (Pa), the reading is strain."""

    inputs_required: ClassVar[frozenset[str]] = frozenset({"temperature", "stress"})
    inputs_optional: ClassVar[frozenset[str]] = frozenset()
    reading: ClassVar[tuple[str, str]] = ("strain", "-")
