"""The C library's enumerations and records are Python's, by name, order, size and offset."""

import re
from pathlib import Path

import pytest

from capsule_sym.generated import interface
from capsule_sym.results import Outcome

HEADER = Path(__file__).parents[2] / "generated" / "capsule" / "c" / "capsule_interface.h"


def test_every_outcome_has_its_type() -> None:
    assert [Outcome(name) for name in interface.OUTCOMES] == [
        Outcome(name.lower().replace("_", "-")) for name in interface.Outcome.__members__
    ]


@pytest.mark.parametrize("name", ["outcome", "precision", "stop"])
def test_enumerations_have_the_order_of_the_header(name: str) -> None:
    text = re.search(rf"typedef enum \{{([^}}]*)\}} capsule_{name};", HEADER.read_text())
    assert text
    members = getattr(interface, name.capitalize()).__members__
    assert re.findall(r"CAPSULE_(\w+)", text[1]) == list(members)
    assert list(map(int, members.values())) == list(range(len(members)))
