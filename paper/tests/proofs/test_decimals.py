"""Balls written as decimals."""

from __future__ import annotations

import pytest

from capsule_sym._enclosures.numbers.balls import Unproved, arb, precision
from paper.proofs.decimals import decimal


@pytest.mark.parametrize("places", [32, 50])
@pytest.mark.parametrize("text", ["0.7000000000000000000000000000049", "-12.125"])
def test_a_decimal_is_within_a_fifth_of_its_last_digit(places: int, text: str) -> None:
    with precision(400):
        value = arb(text) + arb(0, arb(10) ** -places / 10)
        told = decimal(value)
        digits = len(told.partition(".")[2])
        assert digits <= places
        assert (arb(told) - value).abs_upper() < arb(10) ** -digits / 5
        with pytest.raises(Unproved, match="too wide"):
            decimal(value + arb(0, arb("0.3e-30")))
