"""Certificates accepted as they are, and tampered ones refused by the checker and the schema."""

from __future__ import annotations

import json
from functools import cache
from importlib import resources
from pathlib import Path
from types import ModuleType

import jsonschema
import pytest

from capsule_sym._enclosures.certificates import checker
from paper.tests.proofs.tampering import files
from paper.tests.proofs.tampering.tampered import EACH, KINDS, tampered
from tests.enclosures.certified import produced, refused


@pytest.fixture
def module() -> ModuleType:
    """The checker."""
    return checker


@cache
def schema() -> jsonschema.Draft202012Validator:
    home = resources.files("capsule_sym._enclosures.certificates")
    given = json.loads((home / "certificates.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(given)
    return jsonschema.Draft202012Validator(given)


def test_there_are_a_hundred_kinds_of_tampering() -> None:
    assert len(KINDS) + len(files.FILES) >= 100


def test_certificates_are_accepted(module: ModuleType) -> None:
    for one in produced().values():
        module.check_certificate(one)


def test_every_certificate_is_of_the_schema() -> None:
    schema().validate(files.file_of(*produced().values()))


@pytest.mark.parametrize(
    "kind",
    [pytest.param(one, marks=[pytest.mark.long] * one.startswith("digit")) for one in KINDS],
)
def test_tampered_certificates_are_refused_and_the_schema_agrees(
    kind: str, module: ModuleType
) -> None:
    of_schema = schema()
    found = list(tampered(kind, EACH, 1))
    assert found
    for one in found:
        valid = of_schema.is_valid(files.file_of(one))
        assert not (valid and kind.startswith("form"))
        with pytest.raises(module.Rejected) as refusal:
            module.check_certificate(one)
        assert ("schema" in str(refusal.value)) != valid


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_all_that_is_tampered_is_refused(kind: str, module: ModuleType) -> None:
    every = tampered(kind, tuple(produced()), 10**6)
    assert [one for one in every if not refused(one, module)] == []


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
