"""Quantities as people write them, in the program's own units."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from smajax.core.units import UnitError, convert, own_unit, parse_quantity, to_si


@pytest.mark.parametrize(
    ("text", "expected", "value"),
    [
        ("24.2 J/g", "J/kg", 24200.0),
        ("341 K", "degC", 67.85),
        ("22 degC", "degC", 22.0),
        ("22 °C", "degC", 22.0),
        ("212 degF", "degC", 100.0),
        ("5 degC", "K", 5.0),
        ("9 delta_degF", "K", 5.0),
        ("0.2 cal/(g degC)", "J/(kg K)", 836.8),
        ("7 MPa/degC", "Pa/K", 7e6),
        ("7 MPa/K", "Pa/K", 7e6),
        ("5 %", "-", 0.05),
        ("5%", "1", 0.05),
        ("0.3", "1", 0.3),
        ("45 deg", "rad", math.pi / 4),
        ("70 W/m^2/K", "W/(m^2 K)", 70.0),
        ("4.3 Ohm/m", "ohm/m", 4.3),
        ("-35 g", "kg", -0.035),
        ("1e-3 N m s/rad", "N m s/rad", 1e-3),
        ("50 ms", "s", 0.05),
        ("20.6 µm", "m", 20.6e-6),
        ("76 microohm cm", "ohm m", 76e-8),
    ],
)
def test_a_quantity_is_read_in_the_expected_unit(text: str, expected: str, value: float) -> None:
    assert parse_quantity(text, expected) == pytest.approx(value, rel=1e-9)


def test_a_number_is_a_quantity_without_a_unit() -> None:
    assert parse_quantity(0.25, "1") == 0.25
    with pytest.raises(UnitError, match=r"without a unit, expected one like 'Pa'; write '0.25 Pa'"):
        parse_quantity(0.25, "Pa")


def test_a_noise_in_kelvin_is_a_difference_where_a_temperature_is_expected() -> None:
    assert parse_quantity("0.5 K", "degC", difference=True) == pytest.approx(0.5)
    assert parse_quantity("0.5 degC", "degC", difference=True) == pytest.approx(0.5)
    assert parse_quantity("0.5 K", "degC") == pytest.approx(-272.65)


@pytest.mark.parametrize(
    ("text", "expected", "words"),
    [
        (
            "3 m",
            "s",
            r"^got unit 'm' \(minutes are 'min'\), expected one like 's', to which it cannot be converted; change",
        ),
        ("7 MPa/C", "Pa/K", "'C' is the coulomb; write degC"),
        ("3 delta_degC", "degC", "got a temperature difference"),
        ("3 furlongz", "m", "unit 'furlongz' is not known; expected one like 'm'$"),
        ("3 furlongz", "1", r"unit 'furlongz' is not known; write it like 'J/\(kg K\)'"),
        ("3 mVolt", "V", r"unit 'mVolt' is not known; did you mean 'mV'\?$"),
        ("3 Amps", "A", "did you mean 'A'"),
        ("3 KPA", "Pa", "did you mean 'kPa'"),
        ("fast", "m", "got 'fast', expected a number and a unit"),
        ("nan m", "m", "expected a number"),
        ("1e999 m", "m", "expected a finite number"),
        ("3 rad", "1", "got an angle"),
        ("3 %", "rad", "expected an angle; write it with 'deg' or 'rad'"),
        ("45", "rad", "without a unit"),
        ("3 m/(", "m", "is not known"),
    ],
)
def test_a_quantity_that_does_not_fit_says_so(text: str, expected: str, words: str) -> None:
    with pytest.raises(UnitError, match=words):
        parse_quantity(text, expected)


def test_to_si_takes_a_number_in_a_unit_or_text_of_the_same_kind() -> None:
    assert to_si(24.2, "J/g") == pytest.approx(24200.0)
    assert to_si("24.2 J/g", "J/kg") == pytest.approx(24200.0)
    assert to_si(300.0, "K") == pytest.approx(26.85)
    assert to_si(90.0, "deg") == pytest.approx(math.pi / 2)
    assert to_si("5 MPa", "kPa") == pytest.approx(5e6)
    assert to_si(2.0, "g") == pytest.approx(0.002)
    assert own_unit("degF") == "degC"
    with pytest.raises(UnitError):
        to_si("5 MPa", "m")


def test_arrays_keep_their_shape() -> None:
    np.testing.assert_allclose(convert(np.array([[0.0, 100.0]]), "degF", "degC"), [[-160 / 9, 340 / 9]])


@pytest.mark.parametrize("text", ["0,31 mm", "1,5", "-2,5e1 V"])
def test_a_decimal_comma_in_a_quantity_is_named(text: str) -> None:
    with pytest.raises(UnitError, match=f"expected a decimal point; write '{re.escape(text.replace(',', '.'))}'"):
        parse_quantity(text, "mm")


def test_a_prefix_moves_the_point_and_changes_no_bit() -> None:
    """A fifth of these are another float where the number is multiplied by the prefix, 0.84e-6 among them."""
    for unit, expected, power in (("mm", "m", -3), ("µΩ m", "ohm m", -6), ("MPa/K", "Pa/K", 6), ("%", "1", -2)):
        for number in ("0.84", "-6.894757", "1.7E-3", *(f"{k / 100:g}" for k in range(1, 100))):
            value = float(f"{float(number):.9f}e{power}")
            assert parse_quantity(f"{number} {unit}", expected) == value
            assert parse_quantity(f"{number} {unit}", expected, difference=True) == value
    assert parse_quantity("0." + "0" * 80 + "1e81 mm", "m") == pytest.approx(0.001)


def test_a_unit_library_that_lacks_a_package_is_no_unknown_unit(monkeypatch: pytest.MonkeyPatch) -> None:
    def without() -> object:
        raise ModuleNotFoundError("No module named 'platformdirs'")

    monkeypatch.setattr("smajax.core.units._registry", without)
    with pytest.raises(ModuleNotFoundError, match="platformdirs"):
        convert(1.0, "furlong", "m")
