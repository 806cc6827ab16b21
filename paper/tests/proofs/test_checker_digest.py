"""Libraries in the digest of the code that proves, and in the files that it writes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from capsule_sym import InvalidInput
from paper.proofs import digest as module
from paper.proofs.subdivision import FROM_REST, begun, prove


@pytest.mark.parametrize("name", module.libraries())
def test_another_version_of_a_library_is_another_digest(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    was, versions = module.digest(()), module.libraries()
    monkeypatch.setattr(module, "libraries", lambda: {**versions, name: "0.0.1"})
    assert module.digest(()) != was


def test_a_file_of_other_libraries_is_refused_with_what_differs(tmp_path: Path) -> None:
    path = tmp_path / "rest.jsonl"
    prove(path, 1e-9, task=FROM_REST)
    header = json.loads(path.read_text().splitlines()[0])
    assert header["libraries"] == module.libraries()
    begun(path, FROM_REST)
    libraries = {**header["libraries"], "python-flint": "0.6.0"}
    path.write_text(json.dumps(FROM_REST.begin() | {"code": "0", "libraries": libraries}) + "\n")
    now = module.libraries()["python-flint"]
    with pytest.raises(InvalidInput, match=f"proved by python-flint 0.6.0, not {now}"):
        begun(path, FROM_REST)


def test_a_file_without_names_of_libraries_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "rest.jsonl"
    for libraries in ([1], 1, "FLINT", None):
        path.write_text(json.dumps(FROM_REST.begin() | {"libraries": libraries}) + "\n")
        with pytest.raises(
            InvalidInput, match="one that `python -m paper enclose --from-rest` wrote"
        ):
            begun(path, FROM_REST)
