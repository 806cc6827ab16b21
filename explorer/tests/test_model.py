"""The page's facts of a scene: those of its declaration, and records where the library has them."""

import json
import math
import re

import pytest

from capsule_sym._parameters import CAPSULE
from capsule_sym._symbolic.model.symbols import MODEL
from capsule_sym.scenes import SHIPPED
from explorer import build, model


@pytest.mark.parametrize(
    "name", ["capsule", *(pytest.param(s, marks=pytest.mark.long) for s in SHIPPED[1:])]
)
def test_facts_are_those_of_the_declaration(name):
    found = model.text().encode() if name == SHIPPED[0] else build.model(name)
    assert found == (build.HERE / "src" / "models" / f"{name}.ts").read_bytes()


def test_the_page_has_a_field_for_each_parameter_and_quantity():
    text = model.text()
    rows = {name: json.loads(row) for name, row in re.findall(r"^  (\w+): (\{.*\}),$", text, re.M)}
    declared = (*MODEL.parameters, *MODEL.quantities)
    assert rows.keys() == {one.name for one in declared}
    for one in declared:
        row = rows[one.name]
        assert (row["symbol"], row["low"], row["high"]) == (one.letter, one.low, one.high)
        assert (row["name"], row["about"], row.get("unit", "")) == (
            one.label,
            one.about,
            getattr(one, "unit", "").replace("^2", "²"),
        )


@pytest.mark.parametrize("name", model.RECORDS)
def test_the_page_reads_records_where_the_library_has_them(name):
    text = model.text()
    (rows,) = re.findall(rf"^export const {name}At = .*?^\}}\);", text, re.M | re.S)
    (size,) = re.findall(rf"^export const {name.upper()}_SIZE = (\d+);", text, re.M)
    read = re.findall(r"(\w+)\(v, at \+ (\d+)\)", rows)
    record = getattr(CAPSULE.records, name.upper())  # its offsets are those of the compiled library
    kinds = {"<f8": "double", "<i8": "int64_t", "<i4": "int32_t"}
    fields = [record.fields[field][:2] for field in record.names]
    assert int(size) == record.itemsize
    assert [(kind, int(at)) for kind, at in read] == [
        (kinds[kind.base.str], at + i * kind.base.itemsize)
        for kind, at in fields
        for i in range(math.prod(kind.shape))
    ]
    assert re.findall(r"^  (\w+): ", rows, re.M) == [*record.names]
