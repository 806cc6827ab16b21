"""Jacobians of the flow against central differences of the flow at 60 digits, every column."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import pytest
from mpmath import mp, mpf

from capsule_sym.generated.capsule.mp import kernels as exact
from tests.judges import DRIFT
from tests.sampling import sampled, some

STEP = mpf("1e-17")
AGREEMENT = mpf("1e-28")  # STEP squared, times a third derivative
KINDS = ("weak", "near resonance", "resonance", "near critical", "critical", "strong")
PARAMETERS = exact.JACOBIAN_COLUMNS[5:]


@dataclass(frozen=True)
class Point:
    """A segment with everything that its flow depends on, by the Jacobian's column names."""

    field: int
    values: dict[str, Any]

    def moved(self, column: str, step: Any) -> Point:
        return Point(self.field, {**self.values, column: self.values[column] + step})

    def constants(self) -> Any:
        return exact.constants(self.field, *(self.values[name] for name in PARAMETERS))

    def start(self) -> Any:
        v, c = self.values, self.constants()
        gap = v["x_r"] - v["delta"]
        margin = v["x_r"] + c.kappa * gap + 2 * v["zeta"] * v["v_r"] - c.friction
        angle = mp.cos(v["theta"]), mp.sin(v["theta"])
        return exact.Start(v["x_r"], gap, v["v_r"], v["v_c"], margin, *angle)

    def end(self) -> list[Any]:
        """x_r, v_r and, in drift, v_c and the advance of x_c after the duration."""
        c = self.constants()
        position, velocity, *rest = exact.flow(c, self.start(), self.values["h"], advance=True)
        end = [self.values["x_r"] + position, velocity]
        return [*end, self.values["v_c"] + rest[0], rest[1]] if rest else end

    def jacobian(self) -> list[list[Any]]:
        return exact.jacobian(self.constants(), self.start(), self.values["h"])


def points(field: int, kind: str) -> Iterator[Point]:
    """A short, a middle and a long segment of one field and kind of damping."""
    rng = random.Random(f"{field} {kind}")
    for h in (rng.uniform(0.01, 0.3), rng.uniform(1, 3), rng.uniform(6, 20)):
        beta, gamma, delta = (mpf(rng.uniform(*r)) for r in ((0.5, 5), (0.3, 8), (0.01, 0.5)))
        inertia = (gamma + 1) / gamma if DRIFT[field] else mpf(1)
        stiffness = inertia * (1 + beta * (field > 3))
        omega, zeta = mpf(rng.uniform(0.2, 5)), mpf("0.05")
        if "resonance" in kind:
            # A zero damping ratio cannot be stepped down from: it is one step above.
            omega, zeta = mp.sqrt(stiffness), STEP
        if "critical" in kind:
            zeta = mp.sqrt(stiffness) / inertia
        if kind == "strong":
            zeta = mpf(8)
        if kind.startswith("near"):
            omega, zeta = omega * (1 + mpf("1e-9")), zeta * (1 + mpf("1e-9"))
        state = mpf(rng.uniform(-1, 1)), mpf(rng.uniform(-1, 1)), mpf(rng.uniform(-1, 1))
        angle, alpha = mpf(rng.uniform(0, 6)), mpf(rng.uniform(0.1, 2))
        values = (*state, angle, mpf(h), alpha, omega, delta, zeta, beta, gamma, mpf(1))
        yield Point(field, dict(zip(exact.JACOBIAN_COLUMNS, values, strict=True)))


def worst(point: Point, entries: list[list[Any]]) -> tuple[Any, str]:
    """Largest difference between the entries and central differences, in the entry's own size."""
    found = []
    for j, column in enumerate(exact.JACOBIAN_COLUMNS):
        ahead, behind = point.moved(column, STEP).end(), point.moved(column, -STEP).end()
        for i, (after, before) in enumerate(zip(ahead, behind, strict=True)):
            slope = (after - before) / (2 * STEP)
            # Below one the increment of the step, not of the entry, limits a central difference.
            found.append((abs(entries[i][j] - slope) / max(1, abs(slope)), f"row {i}, {column}"))
    return max(found)


@sampled
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("field", range(1, 7))
def test_every_column_is_the_slope_of_the_flow(field: int, kind: str) -> None:
    with mp.workdps(60):
        for point in some(points(field, kind), 1):
            error, entry = worst(point, point.jacobian())
            assert error < AGREEMENT, (entry, point)


@pytest.mark.parametrize("field", range(1, 7))
def test_sensitivity_with_a_wrong_sign_is_seen(field: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A change of sign in the generated code of one sensitivity does not pass."""
    doubled = exact.forced_slopes_doubled

    def wrong(*arguments: Any) -> Any:
        B2, *others = doubled(*arguments)
        return -B2, *others

    monkeypatch.setattr(exact, "forced_slopes_doubled", wrong)
    with mp.workdps(60):
        middle = list(points(field, "resonance"))[1]
        assert worst(middle, middle.jacobian())[0] > mpf("1e-6")
