"""Records as texts: long tables and lists are cut with their numbers, and values have units."""

import pytest

from capsule_sym._texts.records import show


@pytest.fixture
def shown(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("COLUMNS", "100")

    def lines(record) -> list[str]:
        show(record)
        return [line.rstrip() for line in capsys.readouterr().out.splitlines()]

    return lines


def test_a_long_table_has_its_last_row_and_its_number(shown) -> None:
    lines = shown({"rows": [{"value": k} for k in range(112)]})
    assert lines[0] == "rows"
    assert lines[3] == "0"
    assert lines[-2:] == ["111", "20 of 112 rows"]
    assert shown({"rows": [{"value": k} for k in range(20)]})[-1] == "19"


def test_of_many_events_the_first_are_named(shown) -> None:
    events = [{"time": float(k), "event": "F3"} for k in range(293)]
    (line, *more) = shown({"differences": [{"missed": [], "invented": events, "gap": 0.5}]})[3:]
    text = " ".join(" ".join((line, *more)).split())
    assert text.startswith("time 0, event F3; time 1, event F3;")
    assert "and 281 more" in text


def test_values_have_units_and_missing_ones_no_line(shown) -> None:
    units = {"P_d": "N", "mu": "", "k2": "N/m"}
    record = {"over": {"P_d": 3.5, "mu": 0.2}, "standard_errors": {"P_d": 0.1, "k2": None}}
    lines = [" ".join(line.split()) for line in shown({**record, "units": units})]
    assert lines == ["over P_d 3.5 N, mu 0.2", "standard errors P_d 0.1 N"]


def test_along_a_parameter_ranges_and_the_first_itinerary_are_shown(shown) -> None:
    one = {
        "alpha": [1.0, 1.4, 1.2],
        "attractor": [0, 0, 0],
        "fraction": [0.5, 0.4, 0.45],
        "itinerary": ["F5 F2", "F5 F4", "F5 F2"],
        "birth": None,
        "death": {"value": 1.54, "type": "fold"},
    }
    lines = shown({"parameter": "alpha", "attractors": [one]})
    row = " ".join(lines[-1].split())
    assert row == "1 to 1.4 0 0.4 to 0.5 1.54 fold F5 F2 and 1 other"
