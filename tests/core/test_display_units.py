"""Numbers and units as pages show them."""

from __future__ import annotations

import numpy as np
import pytest

from smajax.core.display_units import correlation, digits, display, p_value, with_error
from tests.helpers.made_findings import NAN


@pytest.mark.parametrize(
    ("unit", "quantity", "value", "text"),
    [
        ("m", "position", 0.0123456, "12.35"),
        ("rad", "angle", np.pi / 4.0, "45"),
        ("-", "strain", 0.041, "4.1"),
        ("-", "martensite_fraction", 0.041, "0.041"),
        ("Pa", "stress", 172e6, "172"),
        ("N s/m", "damping", 2.0, "2"),
        ("W/(m^2 K)", "", 1.0e-7, "1e-7"),
        ("m", "position", NAN, "–"),
    ],
)
def test_numbers_are_shown_in_their_display_units(unit, quantity, value, text):
    assert digits(display(unit, quantity).of(value)) == text


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (149.98765, 0.301, "149.99 ± 0.30"),
        (24.1873, 0.2106, "24.19 ± 0.21"),
        (2.0, None, "2"),
        (2.0, NAN, "2"),
        (71234.0, 512.0, "71230 ± 510"),
        (858.2, 112.0, "860 ± 110"),
        (858.2, 99.7, "860 ± 100"),
        (7.1234e9, 5.1e6, "7.1234e9 ± 5.1e6"),
        (0.0, 1.0e-9, "0.0 ± 1.0e-9"),
        (3.2e-9, 1.1e-9, "3.2e-9 ± 1.1e-9"),
        (NAN, 0.1, "–"),
    ],
)
def test_an_error_sets_the_decimals_of_its_value(value, error, text):
    assert with_error(value, error) == text


def test_numbers_that_round_to_nothing_or_have_underflowed():
    assert [correlation(value) for value in (1.7e-16, -0.004, 0.126, -0.9, NAN, None)] == [
        "0",
        "0",
        "0.13",
        "-0.90",
        "–",
        "–",
    ]
    assert [p_value(value) for value in (0.0, 0.413)] == ["p < 1e-300", "p = 0.41"]
