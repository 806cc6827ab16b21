"""Intervals of fits hold the truth as often as they say, with each loss and with outliers."""

import pytest
from scipy.stats import binom

from benchmarks.experiments.intervals import held
from tests.sampling import ALL, many, sampled


@sampled
@pytest.mark.parametrize(
    ("loss", "errors"),
    [
        ("linear", "normal"),
        ("linear", "unlike"),
        ("cauchy", "outliers"),
    ],
)
def test_intervals_hold_the_truth(loss, errors) -> None:
    sets = many(200, 4)
    found = held(loss, errors, 20, range(sets))
    # Fewer of each parameter than this happen once in a million.
    assert found.sum(axis=0).min() >= binom.ppf(1e-6, sets, 0.95)
    if ALL:
        assert 0.92 < found.mean() < 0.98
