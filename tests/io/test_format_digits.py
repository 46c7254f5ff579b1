"""Numbers of messages and reports: digits that count, and no powers of ten."""

import pytest

from airborne.errors import format_digits


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(150.3, 2, "150"), (1234.5, 3, "1230"), (0.0342, 2, "0.034"), (9.96, 2, "10"), (-7.0, 3, "-7"), (0.0, 2, "0")],
)
def test_so_many_digits_count_and_none_is_a_power_of_ten(value, digits, text):
    assert format_digits(value, digits) == text


def test_unknown_numbers_are_said_as_they_are():
    assert [format_digits(each, 2) for each in (float("nan"), float("inf"))] == ["nan", "inf"]
