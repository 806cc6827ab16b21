"""Kernels of every scene against exponentials of matrices, in 50 digits.

The matrices are written down from the general form of the equations of motion, once more apart from
the declarations. Jacobians are compared with differences of flows that were found right.
"""

import random
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import pytest
from mpmath import mp, mpf

from capsule_sym import _closed_forms, _native
from capsule_sym._closed_forms import Kernels
from capsule_sym._parameters import scene
from capsule_sym.generated.capsule import fields as linear
from tests.sampling import many, sampled, some
from tests.scenes import GENERAL, SCENES, UNIT, Form

DIGITS, AGREEMENT = 50, mpf("1e-38")
MORE, STEP = 110, mpf("1e-36")  # digits and steps of differences
BOUND = 64.0  # roundings of the largest terms, on the way of some 20 operations and their inputs
DAMPING = ("none", "weak", "critical", "strong", "near resonance", "near critical")
CONFLUENT = ("resonance", "confluent")  # in all digits


class Field(NamedTuple):
    """A field of a form by its number: level of the drive (0 is the first), contact, and way."""

    form: Form
    index: int

    @property
    def mode(self) -> tuple[int, int, int]:
        """Level, contact and way."""
        rest, way = divmod(self.index - 1, 3)
        return (*divmod(rest, self.form.stops + 1), 1 - way)


class Case(NamedTuple):
    """One segment: parameters by name, state (x_r, v_r, v_c), forcing angle and duration."""

    field: Field
    parameters: dict[str, Any]
    state: tuple[Any, Any, Any]
    theta: Any
    duration: Any

    def general(self) -> dict[str, Any]:
        """The parameters of the general form; those that a scene lacks are 0."""
        p, names = (
            self.parameters,
            dict(delta_1="delta", beta_1="beta", f_plus="f_b", f_minus="f_b"),
        )
        return {name: p.get(name, p.get(names.get(name, ""), mpf(0))) for name in GENERAL}

    def stop(self) -> Any:
        """x_r at which the spring of the field acts; the front one's without contact."""
        p = self.general()
        return -p["delta_2"] if self.field.mode[1] == 2 else p["delta_1"]

    def rows(self) -> tuple[Any, list[Any], list[Any]]:
        """Rates of (x_r, v_r, v_c, x_c, alpha cos, alpha sin, 1), P and Q, and that start."""
        p, form, (level, contact, way) = self.general(), self.field.form, self.field.mode
        kappa = (mpf(0), p["beta_1"], p["beta_2"])[contact]
        drive = [mpf(0)] * 7
        if form.pulsed:
            drive[6] = p["alpha_low" if level else "alpha"]
        else:
            drive[4] = mpf(1)
        force = [1 + kappa, 2 * p["zeta"], *[mpf(0)] * 4, -kappa * self.stop()]
        pull = [a - form.reacts * u for a, u in zip(force, drive, strict=True)]
        bound = {1: p["f_plus"], 0: mpf(0), -1: -p["f_minus"]}[way]
        one = [mpf(0)] * 6 + [mpf(1)]
        slip = [
            (a - bound * i) / p["gamma"] if way else mpf(0) for a, i in zip(pull, one, strict=True)
        ]
        terms = zip(drive, force, slip, one, strict=True)
        rates = mp.zeros(7, 7)
        rates[0, 1] = rates[3, 2] = 1
        rates[1, :] = mp.matrix([[u - f - c - p["s"] * i for u, f, c, i in terms]])
        rates[2, :] = mp.matrix([slip])
        rates[4, 5], rates[5, 4] = -p["omega"], p["omega"]
        angle = (p["alpha"] * mp.cos(self.theta), p["alpha"] * mp.sin(self.theta))
        return rates, pull, [*self.state, mpf(0), *angle, mpf(1)]

    def with_(self, kernels: Kernels, number: Any = mpf) -> tuple[Any, Any]:
        """Constants and start of kernels; what stands in the start is rounded once."""
        p = {name: number(value) for name, value in self.parameters.items()}
        c = kernels.constants(self.field.index, **p)
        _, pull, y = self.rows()
        friction = self.general()
        friction = {1: friction["f_plus"], 0: 0, -1: -friction["f_minus"]}[self.field.mode[2]]
        margin = mp.fdot(pull, y) - friction
        x_r, v_r, v_c = self.state
        angle = mp.cos(self.theta), mp.sin(self.theta)
        return c, kernels.Start(*map(number, (x_r, x_r - self.stop(), v_r, v_c, margin, *angle)))


def cases(name: str, kind: str, count: int) -> Iterator[Case]:
    """Random segments of each field, from short ones to some of many oscillations."""
    form, r = SCENES[name], random.Random(f"{name} {kind}")
    fields = 3 * (1 + form.stops) * (1 + form.pulsed)
    for index in range(1, fields + 1):
        field = Field(form, index)
        _, contact, way = field.mode
        for duration in (1e-4, 1e-2, 0.5, 3.0, 20.0)[:count] if count > 2 else (1e-3, 4.0)[:count]:
            p = {one: r.uniform(0.1, 2) for one in form.names}
            stiff = p.get(("", "beta" if form.stops == 1 else "beta_1", "beta_2")[contact], 0.0)
            inertia = 1 + 1 / p["gamma"] if way else 1.0
            critical = ((1 + stiff) / inertia) ** 0.5
            p["zeta"] = {"weak": 0.05, "critical": critical, "strong": 5.0}.get(kind, 0.0)
            if kind == "near critical":
                p["zeta"] = critical * (1 + 1e-9)
            if kind == "near resonance" or (kind == "none" and r.random() < 0.5):
                p["omega"] = (inertia * (1 + stiff)) ** 0.5 * (1 + 1e-9 * (kind != "none"))
            if "D" in p:
                p["D"] = r.uniform(0.1, 0.9)
            for signed in ("s", "alpha_low"):
                if signed in p:
                    p[signed] = r.uniform(-1, 1)
            state = tuple(mpf(r.uniform(-1, 1)) for _ in range(3))
            given = {one: mpf(value) for one, value in p.items()}
            with mp.workdps(MORE):
                inertia, stiff = 1 + bool(way) / given["gamma"], mpf(stiff)
                if kind == "resonance":
                    given["omega"] = mp.sqrt(inertia * (1 + stiff))
                if kind == "confluent":
                    given["zeta"] = mp.sqrt((1 + stiff) / inertia)
            yield Case(
                field, given, state, mpf(r.uniform(0, 6.28)), mpf(duration * r.uniform(1, 2))
            )


def motion(case: Case) -> list[Any]:
    """Increment of x_r, v_r, and in drift increments of v_c and x_c, by the exponential."""
    rates, _, y = case.rows()
    end = mp.expm(rates * case.duration) * mp.matrix(y)
    found = [end[0] - y[0], end[1], end[2] - y[2], end[3]]
    return found if case.field.mode[2] else found[:2]


def closed(kernels: Kernels, case: Case) -> list[Any]:
    """The same by the kernels."""
    c, start = case.with_(kernels)
    return list(kernels.flow(c, start, case.duration, advance=True))


def differences(kernels: Kernels, case: Case) -> list[list[Any]]:
    """Central differences of a flow's results by each column of the Jacobian, row by row."""

    def moved(column: str, step: Any) -> list[Any]:
        changed = case
        if column in case.parameters:
            value = case.parameters[column] + step
            changed = case._replace(parameters={**case.parameters, column: value})
        elif column in ("x_r", "v_r", "v_c"):
            at = ("x_r", "v_r", "v_c").index(column)
            state = [value + step * (i == at) for i, value in enumerate(case.state)]
            changed = case._replace(state=tuple(state))
        else:
            name = {"theta": "theta", "h": "duration"}[column]
            changed = case._replace(**{name: getattr(case, name) + step})
        found = closed(kernels, changed)
        added = (changed.state[0], 0, changed.state[2], 0)
        return [a + b for a, b in zip(found, added, strict=False)]

    columns = []
    for column in kernels.JACOBIAN_COLUMNS:
        pair = zip(moved(column, STEP), moved(column, -STEP), strict=True)
        columns.append([(a - b) / (2 * STEP) for a, b in pair])
    return [list(row) for row in zip(*columns, strict=True)]


def largest(case: Case) -> Any:
    """The largest part of a motion that one part of its start gives alone, for units of errors."""
    rates, _, y = case.rows()
    amplitude = max(abs(y[4]), abs(y[5]))
    parts = [*map(abs, y[:4]), amplitude, amplitude, mpf(1)]
    rows = [mp.expm(rates * case.duration * share) for share in (mpf(1), mpf(5) / 8, mpf(3) / 8)]
    size = max(abs(row[i, j]) * parts[j] for row in rows for i in range(4) for j in range(7))
    return size * (1 + mp.norm(rates, 2) * case.duration)


@sampled
@pytest.mark.parametrize("name", some(SCENES, 2))
def test_flows_are_exponentials_to_38_digits(name: str) -> None:
    kernels = scene(name).kernels_by(mp)
    kinds = some([*DAMPING, *CONFLUENT], 2)
    with mp.workdps(DIGITS):
        for kind in kinds:
            for case in cases(name, kind, many(5, 2)):
                right, found = motion(case), closed(kernels, case)
                size = 1 + max(map(abs, right))
                for a, b in zip(right, found, strict=True):
                    assert abs(a - b) < AGREEMENT * size, case


@sampled
@pytest.mark.parametrize("name", some(SCENES, 1))
def test_jacobians_are_differences_of_flows(name: str) -> None:
    kernels, r = scene(name).kernels_by(mp), random.Random(name)
    for kind in some([*DAMPING, *CONFLUENT], 1):
        for case in cases(name, kind, many(2, 1)):
            long = case._replace(duration=case.duration * r.choice([1, 1000]))
            assert off(kernels, long) < AGREEMENT, long


def off(kernels: Kernels, case: Case) -> Any:
    """Largest relative difference between a Jacobian's entries and differences of flows."""
    with mp.workdps(MORE):
        right = differences(kernels, case)
        c, start = case.with_(kernels)
        found = kernels.jacobian(c, start, case.duration)
        pairs = [
            pair for rows in zip(right, found, strict=True) for pair in zip(*rows, strict=True)
        ]
        return max(abs(a - b) / (1 + abs(a)) for a, b in pairs)


def test_a_sensitivity_with_a_wrong_sign_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """A change of sign in the generated code of one sensitivity does not pass."""
    basis, kernels = _closed_forms.basis, scene("capsule").kernels_by(mp)
    doubled = basis.forced_slopes_doubled

    def wrong(*arguments: Any) -> Any:
        B2, *others = doubled(*arguments)
        return -B2, *others

    monkeypatch.setattr(basis, "forced_slopes_doubled", wrong)
    for case in cases("capsule", "resonance", 1):
        assert off(kernels, case._replace(duration=mpf(2))) > mpf("1e-6"), case


@sampled
@pytest.mark.parametrize("name", some(SCENES, 2))
def test_a_constant_wrong_in_the_twelfth_digit_is_seen(name: str) -> None:
    kernels = scene(name).kernels_by(mp)
    with mp.workdps(DIGITS):
        for case in cases(name, "weak", 1):
            case = case._replace(duration=mpf(5))
            (c, start), right = case.with_(kernels), motion(case)
            # K and sigma reach the flow also through what is derived from them, such as nu.
            for constant in ("m", "kappa", "push", "friction", "sigma", "K"):
                if value := getattr(c, constant):
                    wrong = c._replace(**{constant: value * (1 + mpf("1e-12"))})
                    found = kernels.flow(wrong, start, case.duration, advance=True)
                    errors = [abs(a - b) for a, b in zip(right, found, strict=True)]
                    assert max(errors) > mpf("1e-30"), (constant, case)


def test_the_linear_fields_of_balls_are_the_equations_of_motion() -> None:
    """Rates and guards by the general form, and their derivatives by differences."""
    kept = [0, 1, 2, 4, 5, 6]

    def dense(entries: Any, rows: int) -> Any:
        found = mp.zeros(rows, len(kept))
        for i, j, value in entries:
            found[i, j] = value
        return found

    with mp.workdps(DIGITS):
        for case in cases("capsule", "weak", 1):
            at, p, (_, contact, way) = case.field.index - 1, case.parameters, case.field.mode
            rates, pull, _ = case.rows()
            gap = [mpf(j == 0) - p["delta"] * (j == 6) for j in range(7)]
            guards = [[(1 if contact else -1) * a for a in gap]]
            guards += [[mpf(j == 2) * way for j in range(7)]] if way else []
            for sign in () if way else (-1, 1):
                guards.append([sign * a + p["f_b"] * (j == 6) for j, a in enumerate(pull)])
            given = [p[name] for name in linear.PARAMETERS]
            for of, by, rows in (
                (
                    linear.RATES[at],
                    linear.RATES_BY[at],
                    [[rates[i, j] for j in kept] for i in kept],
                ),
                (
                    linear.GUARDS[at],
                    linear.GUARDS_BY[at],
                    [[row[j] for j in kept] for row in guards],
                ),
            ):
                assert mp.norm(dense(of(*given), len(rows)) - mp.matrix(rows), 1) < AGREEMENT
                for i, name in enumerate(linear.PARAMETERS):
                    ends = [[*given[:i], given[i] + s, *given[i + 1 :]] for s in (STEP, -STEP)]
                    ahead, behind = (dense(of(*end), len(rows)) for end in ends)
                    slope = dense(by(*given).get(name, ()), len(rows))
                    assert mp.norm((ahead - behind) / (2 * STEP) - slope, 1) < mpf("1e-12"), name


@sampled
@pytest.mark.parametrize("name", some(SCENES, 2))
def test_jets_are_powers_of_the_rates(name: str) -> None:
    """Derivatives of x_r from the second on, and those of the pull Q."""
    kernels = scene(name).kernels_by(mp)
    with mp.workdps(DIGITS):
        for case in cases(name, "weak", 1):
            rates, pull, y = case.rows()
            c, start = case.with_(kernels)
            angle = (start.cos_theta, start.sin_theta)
            found = kernels.jet(c, start.x_r, start.gap, start.v_r, *angle)
            powers = [mp.matrix(y)]
            for _ in range(kernels.JET_ORDER + 1):
                powers.append(rates * powers[-1])
            right = [power[0] for power in powers[2:]]
            right += [mp.fdot(pull, power) for power in powers[:-1]]
            for a, b in zip(right, found, strict=True):
                assert abs(a - b) < AGREEMENT * (1 + abs(a)), case


def test_jets_err_within_their_magnitudes_where_friction_and_drive_cancel() -> None:
    """Their sum is one constant of the field: it has the rounding errors of both."""
    own, r = scene("reaction_pulse"), random.Random(0)
    forward = next(k for k in range(1, 13) if Field(SCENES["reaction_pulse"], k).mode == (1, 0, 1))
    worst = 0.0
    for _ in range(many(200, 50)):
        gamma, f_b = r.uniform(0.1, 10), r.uniform(0.1, 10)
        p = {"alpha": 1.0, "alpha_low": -f_b / (1 + gamma), "D": 0.5, "omega": 1.0, "delta": 1.0}
        p |= {"zeta": 0.1, "beta": 1.0, "gamma": gamma, "f_b": f_b}
        at = (1e-9, -1.0, 1e-9, 1.0, 0.0)
        found = own.kernels.jet(c := own.kernels.constants(forward, **p), *at)
        bounds = own.kernels.jet_magnitudes(c, *map(abs, at[:3]))
        with mp.workdps(DIGITS):
            exact = own.kernels_by(mp)
            given = {name: mpf(value) for name, value in p.items()}
            right = exact.jet(exact.constants(forward, **given), *map(mpf, at))
        errors = [float(abs(a - b)) / UNIT for a, b in zip(found, right, strict=True)]
        assert all(a <= 16 * b for a, b in zip(errors, bounds, strict=True)), p
        worst = max(worst, errors[0] / abs(found[0]))
    assert worst > 1e6  # they do cancel


@sampled
@pytest.mark.parametrize("name", some(SCENES, 1))
def test_doubles_are_right_to_their_conditioning(name: str) -> None:
    """Python's and C's closed forms beside 50 digits of the same doubles."""
    given = scene(name)
    core = _native.core_of(given)
    for kind in some(DAMPING, 2):
        for case in cases(name, kind, many(5, 2)):
            c, start = case.with_(given.kernels, float)
            h = float(case.duration)
            found = [given.kernels.flow(c, start, h, advance=True)]
            rows = [given.kernels.jacobian(c, start, h)]
            if core is not None:
                p = np.array([float(case.parameters[n]) for n in given.facts.PARAMETERS])
                values, by = core.fields(p).closed_form(case.field.index, np.array(start, float), h)
                found.append(values[: len(found[0])])
                rows.append(by[: len(found[0])])
            with mp.workdps(DIGITS):
                kernels = given.kernels_by(mp)
                exact, same = case.with_(kernels)[0], kernels.Start(*map(mpf, start))
                right = kernels.flow(exact, same, case.duration, advance=True)
                right_rows = np.array(kernels.jacobian(exact, same, case.duration))
                size = float(largest(case))
            scale = size * (1 + float(case.duration))
            for values in found:
                errors = [float(abs(a - mpf(float(b)))) for a, b in zip(right, values, strict=True)]
                assert max(errors) <= BOUND * UNIT * scale, (case, max(errors) / UNIT / scale)
            largest_row = np.abs(right_rows.astype(float)).max()
            for by in rows:
                error = np.abs((right_rows - np.asarray(by)).astype(float)).max()
                limit = BOUND * UNIT * (scale + largest_row) * (1 + float(case.duration)) ** 2
                assert error <= limit, (case, error / limit)
