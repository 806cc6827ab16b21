"""The shortest pulses of ten pairs of motions beside brute force."""

import pytest

from benchmarks.experiments.pulses import check


@pytest.mark.long
def test_no_pulse_is_longer_than_that_of_brute_force() -> None:
    assert check(amplitudes=20_000) == 0
