"""The reader of the transcription, and that the run-time code takes Section 4 from it."""

from __future__ import annotations

import subprocess
import sys
from itertools import pairwise

import pytest

from paper import printed as paper
from paper.study import casestudy, thresholds

PRINTED = paper.read()


def test_entries_have_a_place_and_a_reading() -> None:
    for entry in PRINTED:
        assert entry.place
        assert entry.reading in ("clear", "doubtful", "illegible")
        assert entry.printed


def test_twice_the_same_identifier_is_refused() -> None:
    record = {"id": "x", "place": "Eq. (1)", "reading": "clear", "value": "1"}
    with pytest.raises(ValueError, match="x"):
        paper.paper_of({"entry": [record, record]})


def test_rows_of_section_4_follow_one_another() -> None:
    rows = paper.section_4(PRINTED)
    assert len(rows) == 11
    for row, following in pairwise(rows):
        assert following.low == row.high or following.low is None
    assert [row.high for row in rows if row.low is None] == ["0.5245", "1.443"]


def test_case_study_is_the_printed_one() -> None:
    assert {name: float(alpha) for name, alpha in paper.panels(PRINTED).items()} == casestudy.PANELS
    assert len(thresholds.PRINTED) == 8


def test_reader_does_without_sympy() -> None:
    code = "import sys; from paper import printed; printed.read(); print('sympy' in sys.modules)"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout == "False\n"
