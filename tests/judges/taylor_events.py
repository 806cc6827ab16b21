"""The piecewise system to any number of digits: Taylor steps, and every guard root isolated.

`python -m tests.judges.taylor_events --write` regenerates the truth files of `tests/judges/data`.
"""

import argparse
import json
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from mpmath import mp, mpf

from capsule_sym import Parameters
from tests.judges import CONTACT, DRIFT, Run, Segment

DATA = Path(__file__).parent / "data"
ALPHAS = ("0.3", "0.45", "0.7", "1.2", "1.5", "1.64", "1.69", "1.9")
GAMMAS = ("3.3", "3.0")
PERIODS = 20
PRINTED_DIGITS = 40

_GUARD_DIGITS = 15  # beyond the requested digits
_CLEARANCE = 20  # a step must not end with a guard below 10^-_CLEARANCE of its own size
_MAX_SPLITS = 300

Coefficients = tuple[list[Any], list[Any], list[Any], list[Any]]


class Undecided(ArithmeticError):
    """The next switch or the next field cannot be decided at the working precision."""


def run(
    parameters: Parameters,
    state: Sequence[Any] = (0, 0, 0),
    phase: Any = 0,
    periods: int = PERIODS,
    digits: int = 50,
) -> Run:
    """Trajectory over `periods` forcing periods from (x_r, v_r, v_c) at time `phase`, x_c = 0.

    Parameters and state are taken exactly. Every step is a Taylor polynomial whose remainder is
    below the working precision; the first root of every guard polynomial in the step is isolated
    by Descartes' rule, so that no crossing of the polynomial can be missed or invented. Raises
    Undecided where `digits` do not suffice to tell the next switch or field.
    """
    with mp.workdps(digits + _GUARD_DIGITS):
        zero = mpf(10) ** -digits
        here = (*map(mpf, state), mpf(0))
        tau = mpf(phase)
        end = tau + periods * 2 * mp.pi / mpf(parameters.omega)
        segments: list[Segment] = []
        while tau < end:
            here = _snap(parameters, here, zero)
            field = _next_field(parameters, here, tau, zero)
            start = tau
            tau, here = _leg(parameters, field, here, start, end, zero)
            segments.append(Segment(field, start, tau, here))
        return Run(tuple(segments))


def _snap(parameters: Parameters, state: Sequence[Any], zero: Any) -> tuple[Any, ...]:
    """The state put exactly on the surfaces P1 = 0 and P2 = delta that it lies on within `zero`."""
    x_r, v_r, v_c, x_c = state
    delta = mpf(parameters.delta)
    return (
        delta if abs(x_r - delta) <= zero else x_r,
        v_r,
        mpf(0) if abs(v_c) <= zero else v_c,
        x_c,
    )


def _next_field(parameters: Parameters, state: Sequence[Any], tau: Any, zero: Any) -> int:
    """The one field whose own solution from the state stays in its region of Eqs. (7)-(12)."""
    v_c = state[2]
    sign = int(mp.sign(v_c))
    admissible = []
    for field, drift in DRIFT.items():
        if sign not in (0, drift):
            continue
        step = 1 / _norm(parameters, field)
        guards = _guards(parameters, field, _series(parameters, field, state, tau, step, 8))
        leads = [guard[0] if guard else mpf(0) for guard in (_deflate(g, zero) for g in guards)]
        # On a surface for ever: the closed regions are contact (P2 >= delta) and stick.
        closed = [CONTACT[field]] + [drift == 0] * (len(guards) - 1)
        if all(lead > 0 or (lead == 0 and stay) for lead, stay in zip(leads, closed, strict=True)):
            admissible.append(field)
    if len(admissible) != 1:
        raise Undecided(f"one field must hold, not {admissible}, at tau = {mp.nstr(tau, 20)}")
    return admissible[0]


def _leg(
    parameters: Parameters, field: int, state: tuple[Any, ...], start: Any, end: Any, zero: Any
) -> tuple[Any, tuple[Any, ...]]:
    """Time and state at the first switch of the segment, or at `end` if that comes first."""
    tau, longest = start, 1 / _norm(parameters, field)
    order = _order()
    resting: set[int] = set()  # guards that vanish identically
    while tau < end:
        step = min(longest, end - tau)
        while True:
            pieces = _series(parameters, field, state, tau, step, order)
            guards = _guards(parameters, field, pieces)
            if tau == start:
                guards = [_deflate(guard, zero) for guard in guards]
                resting = {number for number, guard in enumerate(guards) if not guard}
            guards = [guard for number, guard in enumerate(guards) if number not in resting]
            if any(guard[0] <= 0 for guard in guards):
                raise Undecided(f"field {field} is left at once at tau = {mp.nstr(tau, 20)}")
            if all(_clear(guard) for guard in guards):
                break
            if step == end - tau:
                raise Undecided(f"a guard vanishes at the end of the run, {mp.nstr(end, 20)}")
            step *= mpf("0.9")
        roots = [root for guard in guards if (root := _first_root(guard)) is not None]
        u = min(roots, default=mpf(1))
        state = tuple(_value(piece, u) for piece in pieces)
        if roots:
            return tau + u * step, state
        tau = end if step == end - tau else tau + step
    return end, state


def _norm(parameters: Parameters, field: int) -> Any:
    """Largest of the forcing frequency and the norm of the field's linear part.

    For x'' = -stiffness x - damping x' the norm is that of the companion matrix in the scaling
    of x' against x that makes it least, r with r^2 = damping r + stiffness. Taylor coefficient
    number k is then bounded by a constant times norm^k / k!.
    """
    share = 1 if DRIFT[field] == 0 else 1 + 1 / mpf(parameters.gamma)
    damping = 2 * share * mpf(parameters.zeta)
    stiffness = share * (1 + (mpf(parameters.beta) if CONTACT[field] else 0))
    return max(mpf(parameters.omega), (damping + mp.sqrt(damping**2 + 4 * stiffness)) / 2)


def _order() -> int:
    """Least order whose first neglected term 1 / order! is below the working precision."""
    order, term = 0, mpf(1)
    while term > mp.eps:
        order += 1
        term /= order
    return order


def _series(
    parameters: Parameters, field: int, state: Sequence[Any], tau: Any, step: Any, order: int
) -> Coefficients:
    """Taylor coefficients 0 to `order` of (x_r, v_r, v_c, x_c) at tau, in powers of time / step.

    The recurrence is Eqs. (7)-(12); the forcing's cosine and sine are carried along as the
    solution of their own differential equation.
    """
    x, v, w, y = ([mpf(number)] for number in state)
    omega, gamma, damping = mpf(parameters.omega), mpf(parameters.gamma), 2 * mpf(parameters.zeta)
    beta = mpf(parameters.beta) if CONTACT[field] else mpf(0)
    preload, friction = beta * mpf(parameters.delta), DRIFT[field] * mpf(parameters.f_b)
    cosine = mpf(parameters.alpha) * mp.cos(omega * tau)
    sine = mpf(parameters.alpha) * mp.sin(omega * tau)
    for k in range(order):
        push = (1 + beta) * x[k] + damping * v[k] - preload
        capsule = (push - friction) / gamma if DRIFT[field] else mpf(0)
        preload = friction = mpf(0)  # constants enter the coefficient of order 0 alone
        scale = step / (k + 1)
        x.append(scale * v[k])
        v.append(scale * (cosine - push - capsule))
        w.append(scale * capsule)
        y.append(scale * w[k])
        cosine, sine = -scale * omega * sine, scale * omega * cosine
    return x, v, w, y


def _guards(parameters: Parameters, field: int, pieces: Coefficients) -> list[list[Any]]:
    """Guard polynomials of a field, positive inside its region; the contact guard comes first."""
    x, v, w, _ = pieces
    delta, f_b, damping = mpf(parameters.delta), mpf(parameters.f_b), 2 * mpf(parameters.zeta)
    gap = [x[0] - delta, *x[1:]]
    contact = gap if CONTACT[field] else [-a for a in gap]
    if drift := DRIFT[field]:
        return [contact, [drift * a for a in w]]
    beta = mpf(parameters.beta) if CONTACT[field] else mpf(0)
    push = [a + damping * b + beta * c for a, b, c in zip(x, v, gap, strict=True)]
    return [contact, [f_b - push[0], *(-a for a in push[1:])], [f_b + push[0], *push[1:]]]


def _deflate(polynomial: list[Any], zero: Any) -> list[Any]:
    """The polynomial without the root that it has at 0, whatever its multiplicity."""
    for power, coefficient in enumerate(polynomial):
        if abs(coefficient) > zero:
            return polynomial[power:]
    return []


def _clear(polynomial: list[Any]) -> bool:
    """True if the polynomial is clear of zero at 1, relative to its largest coefficient."""
    return bool(abs(mp.fsum(polynomial)) > mpf(10) ** -_CLEARANCE * max(map(abs, polynomial)))


def _value(polynomial: Sequence[Any], u: Any) -> Any:
    return mp.polyval(list(reversed(polynomial)), u)


def _first_root(polynomial: list[Any]) -> Any | None:
    """Least root in (0, 1) of a polynomial that is positive at 0 and clear of zero at 1."""
    if polynomial[0] > mp.fsum(map(abs, polynomial[1:])):
        return None
    noise = 10**_GUARD_DIGITS * mp.eps * max(map(abs, polynomial))
    degree = len(polynomial) - 1
    scaled = [a / mp.binomial(degree, i) for i, a in enumerate(polynomial)]
    for first in range(degree):  # powers to Bernstein: b_j = sum_i C(j, i) a_i / C(n, i)
        for j in range(degree, first, -1):
            scaled[j] += scaled[j - 1]
    todo = [(scaled, mpf(0), mpf(1))]
    for _ in range(_MAX_SPLITS):
        if not todo:
            return None
        bernstein, low, high = todo.pop()
        signs = [a > 0 for a in bernstein if a != 0]
        changes = sum(one != two for one, two in pairwise(signs))
        if changes == 1:
            return _polish(polynomial, low, high)
        if changes:
            middle = (low + high) / 2
            left, right = _split(bernstein)
            if abs(left[-1]) <= noise:
                raise Undecided("a guard vanishes at a point of subdivision, as at a tangency")
            todo += [(right, middle, high), (left, low, middle)]
    raise Undecided(f"a guard is not resolved by {_MAX_SPLITS} subdivisions")


def _split(bernstein: list[Any]) -> tuple[list[Any], list[Any]]:
    """Bernstein coefficients over the left and the right half, by de Casteljau's algorithm."""
    row, left, right = bernstein, [bernstein[0]], [bernstein[-1]]
    while len(row) > 1:
        row = [(one + two) / 2 for one, two in pairwise(row)]
        left.append(row[0])
        right.append(row[-1])
    return left, right[::-1]


def _polish(polynomial: list[Any], low: Any, high: Any) -> Any:
    """The one root in [low, high], where the polynomial falls: Newton kept inside by bisection."""
    slope = [power * a for power, a in enumerate(polynomial)][1:]
    u = (low + high) / 2
    for _ in range(_MAX_SPLITS):
        height = _value(polynomial, u)
        if height > 0:
            low = u
        else:
            high = u
        steep = _value(slope, u)
        new = u - height / steep if steep else low
        if not low < new < high:
            new = (low + high) / 2
        if abs(new - u) <= 4 * mp.eps * u:
            return new
        u = new
    raise Undecided("a guard's root does not converge")


def truth(gamma: str) -> dict[str, Any]:
    """The case study from rest at every alpha of ALPHAS: fields and final states in 40 digits.

    The digits are vouched for by a second run with ten more; ArithmeticError when they differ.
    """
    runs = []
    for alpha in ALPHAS:
        parameters = Parameters(alpha=float(alpha), gamma=float(gamma))
        once, again = run(parameters, digits=50), run(parameters, digits=60)
        with mp.workdps(PRINTED_DIGITS + 5):
            gap = max(abs(a - b) for a, b in zip(once.final, again.final, strict=True))
            if once.fields != again.fields or gap > mpf(10) ** -PRINTED_DIGITS:
                raise ArithmeticError(f"alpha = {alpha}, gamma = {gamma}: runs differ by {gap}")
            final = [mp.nstr(number, PRINTED_DIGITS) for number in again.final]
        runs.append({"alpha": alpha, "fields": again.fields, "final": final})
    return {"gamma": gamma, "periods": PERIODS, "runs": runs}


def truth_file(gamma: str) -> Path:
    """File of the truth for this gamma (one of GAMMAS)."""
    return DATA / f"reference_gamma{gamma.replace('.', '')}.json"


def main() -> None:
    """Regenerate the truth files (`--write`), or check that they are up to date."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--write", action="store_true", help="write the files")
    write = parser.parse_args().write
    for gamma in GAMMAS:
        text = json.dumps(truth(gamma), indent=1) + "\n"
        if write:
            truth_file(gamma).write_text(text, encoding="utf-8")
        elif truth_file(gamma).read_text(encoding="utf-8") != text:
            raise SystemExit(f"{truth_file(gamma)} differs: python -m {__spec__.name} --write")


if __name__ == "__main__":
    main()
