"""The theory as those who make claims about it import it: the model, its proofs, and statements.

Nothing of the tool imports this module. Its names are not public, because they belong to one scene.
"""

# ruff: noqa: F401, I001 - imported to be exported
# fmt: off

from capsule_sym._symbolic.model.elimination import Relation, Undecided
from capsule_sym._symbolic.model.geometry import (
    LINES, PIECES, SCENARIOS, SURFACES, StateSet, disjoint, empty, lines_at, meets,
)
from capsule_sym._symbolic.model.model import P1, P2, P3, P4, SEGMENTS, Linear
from capsule_sym._symbolic.model.proof import (
    consistent, evaluate, example, implies, negations, sign_under,
)
from capsule_sym._symbolic.model.switching import (
    Leaf, LocalMap, allowed_maps, derivatives, leaves_of, local_maps, reduced, surface_transitions,
)
from capsule_sym._symbolic.model.symbols import (
    PARAMETERS, STATE, alpha, beta, delta, f_b, force, gamma, omega, tau, v_c, v_r, x_r, zeta,
)
from capsule_sym._symbolic.proofs.appendices import BY_LINE, sliding, stick_does, within_bound
from capsule_sym._symbolic.proofs.cells import CELLS
from capsule_sym._symbolic.proofs.inner_products import (
    FIELDS, STICK_EDGE, along, inner_products, outward,
)
from capsule_sym._symbolic.proofs.markdown import (
    LETTERS, counts, marked, math, point, table, text, theorems,
)
from capsule_sym._symbolic.proofs.parts import PARTS, Part, bifurcations, part
from capsule_sym._symbolic.proofs.reachability import ENTRY_PLANE, witness_text, witnesses
from capsule_sym._symbolic.proofs.statement import (
    Finding, Report, Statement, Verdict, line, named, record, run, vanishes,
)
from capsule_sym._symbolic.proofs.table_proofs import (
    ASSUMED, Pairs, mechanism, on, passages, passages_at,
)
