"""The second checker, put to what the first one accepts and refuses."""

from __future__ import annotations

from types import ModuleType

import pytest

from paper.proofs import second_checker
from paper.tests.proofs.test_checker_tampered import (  # noqa: F401 - the same tests
    test_all_that_is_tampered_is_refused,
    test_certificates_are_accepted,
    test_files_that_are_no_json_are_named_in_one_line,
    test_tampered_certificates_are_refused_and_the_schema_agrees,
    test_tampered_files_are_refused_in_one_line,
)
from paper.tests.proofs.test_checker_terms import (  # noqa: F401
    bits,
    test_a_zero_of_the_equations_that_is_no_motion_is_rejected,
    test_no_last_digit_may_change,
)
from tests.enclosures import certified
from tests.enclosures.test_checker_orbits import (  # noqa: F401
    test_a_checker_works_from_its_file_alone,
    test_an_orbit_is_said_to_be_unstable_if_it_is,
    test_bifurcations_are_certified_with_their_segment_of_duration_0,
    test_no_digit_of_an_orbit_may_change,
    test_orbits_at_other_parameters_are_certified,
)
from tests.enclosures.test_run_certificates import (  # noqa: F401
    run_certificate,
    test_a_motion_at_rest_is_certified_however_long,
    test_a_run_is_certified_from_the_decimals_that_its_doubles_print_as,
    test_checker_rejects_runs_that_are_none,
    test_run_certificate_is_accepted_and_no_digit_may_change,
)

pytestmark = pytest.mark.long


@pytest.fixture
def module() -> ModuleType:
    """The checker."""
    return second_checker


@pytest.fixture(autouse=True)
def second(monkeypatch: pytest.MonkeyPatch) -> None:
    """Puts certificates to the second checker, where the tests name none."""
    monkeypatch.setattr(certified, "checker", second_checker)
