"""The theory as those who make claims about it import it: the model, its proofs, and statements.

Nothing of the tool imports this module. Its names are not public, because they belong to one scene.
"""

# ruff: noqa: F401, I001 - imported to be exported
# fmt: off

from capsule_sym._symbolic.model.elimination import (
    RANGES, VARIABLES, Comparison, Contradiction, Relation, Sign, Undecided, constraint_of, depth,
    eliminations, inverse_gamma, slope_of,
)
from capsule_sym._symbolic.model.extended import coefficients, extended_rates
from capsule_sym._symbolic.model.geometry import (
    LINES, PIECES, SURFACES, StateSet, empty, meets,
)
from capsule_sym._symbolic.model.model import P, P1, P2, P3, P4, SEGMENTS, Linear
from capsule_sym._symbolic.model.proof import (
    always_solvable, consistent, implies, negations, sign_under,
)
from capsule_sym._symbolic.model.switching import (
    Leaf, derivatives, leaves_of, reduced, surface_transitions, time_derivative,
)
from capsule_sym._symbolic.model.symbols import (
    PARAMETERS, STATE, alpha, beta, delta, f_b, force, gamma, omega, tau, v_c, v_r, x_r, zeta,
)
from capsule_sym._symbolic.proofs.cells import CELLS
from capsule_sym._symbolic.proofs.markdown import (
    LETTERS, counts, marked, math, point, table, text, theorems,
)
from capsule_sym._symbolic.proofs.statement import (
    Finding, Relations, Report, Statement, Verdict, line, named, record, run, vanishes,
)
