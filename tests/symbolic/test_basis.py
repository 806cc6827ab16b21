"""The response functions: every statement is proved, and none survives a wrong sign."""

from collections.abc import Iterator

import pytest
import sympy as sp

from capsule_sym._symbolic.model import basis
from capsule_sym._symbolic.model.symbols import h
from capsule_sym._symbolic.proofs.basis_proofs import image, proofs
from capsule_sym._symbolic.proofs.statement import Statement
from tests.sampling import sampled, some

PROOFS = proofs()


def mutants(claim: sp.Expr) -> Iterator[sp.Expr]:
    """The claim with the sign of one term changed, for each term; 1 in place of 0."""
    claim = sp.sympify(claim)
    terms = sp.Add.make_args(claim)
    if len(terms) == 1:
        terms = sp.Add.make_args(sp.expand(claim))
    yield from (claim - 2 * term if term != 0 else sp.Integer(1) for term in terms)


def test_every_proof_holds() -> None:
    assert [proof.name for proof in PROOFS if not proof.holds()] == []


@sampled
@pytest.mark.parametrize("proof", some(PROOFS, 8), ids=lambda proof: proof.name)
def test_wrong_sign_is_refused(proof: Statement) -> None:
    for mutant in mutants(proof.claim["claim"]):
        assert not proof.check(claim=mutant), mutant


def test_every_line_of_the_derivation_is_proved() -> None:
    """Lines of `basis` that the generator and the flow use are claims of proofs."""
    claims = {proof.name: proof.claim["claim"] for proof in PROOFS}
    tables = {
        "initial": basis.INITIAL,
        **{f"derivative.{variable}": rules for variable, rules in basis.RULES.items()},
        "relation": basis.RELATIONS,
        "oscillating": basis.OSCILLATING,
        "overdamped": basis.OVERDAMPED,
        "detached": basis.detached(),
        "sensitivity": basis.sensitivities(),
    }
    doubled = {**basis.double(), **basis.double_sensitivities()}
    for kind, table in {**tables, "double": doubled}.items():
        for name, form in table.items():
            assert claims[f"basis.{kind}.{name}"] == form


def test_product_of_response_functions_has_no_image() -> None:
    with pytest.raises(ValueError, match="not linear in the response functions"):
        image(basis.G * basis.H)


def test_factor_h_is_minus_a_derivative_of_the_image() -> None:
    assert sp.cancel(image(h) - 1 / basis.s**2) == 0
    assert sp.cancel(image(h**2 * basis.G) - sp.diff(1 / basis.Q, basis.s, 2)) == 0
