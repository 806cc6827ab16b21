"""Certificates accepted as they are, and tampered ones refused by both checkers and the schema."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from types import ModuleType
from typing import Any

import jsonschema
import pytest

from capsule_sym._enclosures.certificates import checker, second_checker
from tests.enclosures.certified import CHECKERS, produced, refused
from tests.enclosures.tampering import claims, files, keys, numbers, segments
from tests.enclosures.tampering.kind import KINDS

FEW = {checker: 3, second_checker: 1}  # of a kind and a certificate, in a quick test
BOTH = pytest.mark.parametrize("module", CHECKERS, ids=lambda one: one.__name__.split(".")[-1])
EACH = ("orbit 0.003", "orbit 0.7", "bifurcation 1", "run")


def schema() -> jsonschema.Draft202012Validator:
    home = resources.files("capsule_sym._enclosures.certificates")
    given = json.loads((home / "certificates.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(given)
    return jsonschema.Draft202012Validator(given)


def tampered(kind: str, names: tuple[str, ...], count: int) -> Iterator[Any]:
    """Tampered certificates of a kind, so many of each certificate at most."""
    for name in names:
        given = produced()[name]
        found = [
            one
            for one in KINDS[kind](given)
            if one != given and not (as_true(given, one) or same_corner(given, one))
        ]
        yield from random.Random(kind + name).sample(found, min(count, len(found)))


UNFELT = {
    (2,): ("delta", "beta", "gamma", "f_b"),
    (2, 5): ("gamma", "f_b"),
    (5, 2): ("beta", "gamma", "f_b"),
    (4, 5, 2, 5): ("gamma",),
}
"""Parameters that a capsule that always sticks does not feel: with others it is the same orbit."""


def same_corner(given: Any, other: Any) -> bool:
    """True if the segment of duration 0 is that of the other order of contact and drift there.

    At a corner either may come first: from F4 to F2 by F5 or by F1.
    """
    if given["kind"] != "bifurcation" or given.keys() != other.keys():
        return False
    if {**other, "fields": given["fields"]} != given:
        return False
    (i,), fields = given["still"], given["fields"]
    before, after = fields[i - 1], fields[(i + 1) % len(fields)]
    (one, way), (two, then) = divmod(before - 1, 3), divmod(after - 1, 3)
    either = {3 * one + then + 1, 3 * two + way + 1}
    changed = [*fields[:i], *(either - {fields[i]}), *fields[i + 1 :]]
    return one != two and way != then and other["fields"] == changed


def as_true(given: Any, other: Any) -> bool:
    """True if only parameters are changed that a motion does not feel, in the same form."""
    names = UNFELT.get(tuple(given["fields"]), ())
    if given["kind"] == "run" or given.keys() != other.keys():
        return False
    p, q = given["parameters"], other["parameters"]
    if not isinstance(q, dict) or p.keys() != q.keys():
        return False
    changed = {name for name in p if p[name] != q[name]}
    return changed <= {*names} and {**other, "parameters": p} == given and written(q)


def written(parameters: dict[str, Any]) -> bool:
    return all(
        isinstance(text, str) and re.fullmatch(checker.GIVEN, text) and len(text) <= 400
        for text in parameters.values()
    )


def test_there_are_a_hundred_kinds_of_tampering() -> None:
    assert {claims, files, keys, numbers, segments}
    assert len(KINDS) + len(files.FILES) >= 100


@BOTH
@pytest.mark.parametrize("name", produced())
def test_certificates_are_accepted(name: str, module: ModuleType) -> None:
    module.check_certificate(produced()[name])


def test_every_certificate_is_of_the_schema() -> None:
    schema().validate(files.file_of(*produced().values()))


@BOTH
@pytest.mark.parametrize("kind", KINDS)
def test_tampered_certificates_are_refused_and_the_schema_agrees(
    kind: str, module: ModuleType
) -> None:
    of_schema = schema()
    found = list(tampered(kind, EACH, FEW[module]))
    assert found
    for one in found:
        valid = of_schema.is_valid(files.file_of(one))
        assert not (valid and kind.startswith("form"))
        with pytest.raises(module.Rejected) as refusal:
            module.check_certificate(one)
        assert ("schema" in str(refusal.value)) != valid


@pytest.mark.long
@BOTH
@pytest.mark.parametrize("name", produced())
def test_all_that_is_tampered_is_refused(name: str, module: ModuleType) -> None:
    for kind in KINDS:
        left = [one for one in tampered(kind, (name,), 10**6) if not refused(one, module)]
        assert left == [], kind


@BOTH
@pytest.mark.parametrize("kind", files.FILES)
def test_tampered_files_are_refused_in_one_line(
    kind: str, module: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, of_schema = tmp_path / "file.json", schema()
    for one in files.FILES[kind](produced()["orbit 0.003"]):
        assert not of_schema.is_valid(one)
        path.write_text(json.dumps(one))
        assert module.main([str(path)]) == 1
        lines = capsys.readouterr().out.splitlines()
        assert "rejected" in lines[-1]
        assert all("accepted" in line for line in lines[:-1])


@BOTH
def test_files_that_are_no_json_are_named_in_one_line(
    module: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "file.json"
    for name, content in files.texts(produced()["orbit 0.003"]):
        path.write_bytes(content)
        assert module.main([str(path)]) == 2, name
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith(f"{path}: cannot be read")
    for other in (tmp_path, tmp_path / "missing.json"):
        assert module.main([str(other)]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith(f"{other}: cannot be read")
