"""The closed-form flow, its jets and Jacobians: proved, and none survives a wrong sign."""

import tomllib
from pathlib import Path

import pytest
import sympy as sp

from capsule_sym._symbolic.model import jacobian, jets
from capsule_sym._symbolic.model.model import SEGMENTS
from capsule_sym._symbolic.proofs.flow_proofs import JET_ORDER, proofs
from capsule_sym._symbolic.proofs.statement import Statement
from tests.sampling import sampled, some


def proofs_of(name: str) -> list[Statement]:
    """Those of a segment, or those of all segments."""
    if name in (segment.name for segment in SEGMENTS):
        return [proof for proof in proofs() if f".{name}." in proof.name]
    ours = [proof.name for segment in SEGMENTS for proof in proofs_of(segment.name)]
    return [proof for proof in proofs() if proof.name not in ours]


NAMES = [segment.name for segment in SEGMENTS] + ["all"]


def test_every_proof_has_its_place() -> None:
    assert all(proofs_of(name) for name in NAMES)
    assert sum(len(proofs_of(name)) for name in NAMES) == len(proofs())


@pytest.mark.parametrize("name", NAMES)
def test_proofs(name: str) -> None:
    for proof in proofs_of(name):
        assert proof.holds(), proof.name


@sampled
@pytest.mark.parametrize("name", some(NAMES, 4))
def test_wrong_signs_are_refused(name: str) -> None:
    for proof in some(proofs_of(name), 3):
        claim = sp.sympify(proof.claim["claim"])
        terms = sp.Add.make_args(claim)
        # One term of a Jacobian's entry, which costs most to check, and every term of the rest.
        for term in terms[:1] if proof.name.startswith("jacobian") else terms:
            mutant = claim - 2 * term if term != 0 else sp.Integer(1)
            assert not proof.check(claim=mutant), (proof.name, mutant)


def test_every_line_of_the_derivation_is_proved() -> None:
    names = {proof.name for proof in proofs()}
    for segment in SEGMENTS:
        assert names >= {f"flow.{segment.name}.field.{of}" for of in ("x_r", "v_r", "v_c", "pull")}
    for kind, states in {"drift": ("x_r", "v_r", "v_c", "x_c"), "stick": ("x_r", "v_r")}.items():
        assert names >= {f"flow.{kind}.{state}" for state in states}
        assert names >= {f"jets.{kind}.x2", f"jets.{kind}.p0"}
        columns = map(str, jacobian.COLUMNS)
        assert names >= {f"jacobian.{kind}.{state}.{c}" for c in columns for state in states}
    assert names >= {f"jets.{symbol}" for symbol, _ in jets.jet(JET_ORDER)} - {"jets.x2", "jets.p0"}


def test_jets_are_proved_to_the_order_that_is_generated() -> None:
    inputs = Path(__file__).parents[2] / "codegen" / "kernels.toml"
    assert tomllib.loads(inputs.read_text(encoding="utf-8"))["jet_order"] == JET_ORDER
