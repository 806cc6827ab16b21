"""Expected verdicts of the claims: a changed verdict, text or witness, a statement gone or new."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from capsule_sym._symbolic.proofs.statement import Finding, settle
from paper.claims import everything, frozen
from paper.claims.frozen import Expected, differences
from paper.printed import read

_SOME = ("printed.normal", "printed.figure.3", "printed.equation.16", "erratum.equation.23")


@cache
def results() -> dict[str, Finding]:
    some = (i for i in everything.statements(read()) if i.name.startswith(_SOME))
    return {item.name: settle(item) for item in some}


def test_unchanged_results_do_not_differ() -> None:
    assert not list(differences([*results().values()], frozen.expected(), whole=False))


def _with(result: Finding, **changes: object) -> list[str]:
    item = replace(result.statement, **{k: v for k, v in changes.items() if k != "status"})
    status = changes.get("status", result.status)
    other = replace(result, statement=item, status=status)
    return list(differences([other], frozen.expected(), whole=False))


def test_changed_verdict_differs() -> None:
    (line,) = _with(results()["printed.equation.16"], status="failed")
    assert line == "printed.equation.16: failed, expected: proved"


def test_changed_erratum_differs_though_it_is_still_refuted() -> None:
    result = results()["erratum.equation.23"]
    assert len(_with(result, printed="on L2 it is 0")) == 1
    assert len(_with(result, derived="on L2 it is 1")) == 1
    other = replace(result, witness={**result.witness, "v_r": "7"})
    assert len(list(differences([other], frozen.expected(), whole=False))) == 1


def test_missing_and_new_statements_differ() -> None:
    known = Expected({name: "proved" for name in results()} | {"gone": "proved"}, {})
    lines = list(differences([*results().values()][:1], known))
    assert any(line == "gone: missing, expected: proved" for line in lines)
    (line,) = differences([*results().values()][:1], Expected({}, {}))
    assert line.endswith("and not expected")


def test_frozen_results_are_read_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "verdicts.toml"
    frozen.freeze([*results().values()], path)
    monkeypatch.setattr(frozen, "PATH", path)
    frozen.expected.cache_clear()
    try:
        assert not list(differences([*results().values()], frozen.expected()))
    finally:
        frozen.expected.cache_clear()
