"""Gradients of every scene's formulas, beside differences of the equations of motion."""

import inspect
from collections.abc import Callable
from typing import Any

import pytest
from mpmath import mp, mpf

from capsule_sym._parameters import scene
from tests.crosscheck.test_kernels_scenes import Case, cases
from tests.scenes import SCENES

STEP = mpf("1e-20")


def drive(case: Case) -> Any:
    """The drive u."""
    p, level = case.general(), case.field.mode[0]
    if case.field.form.pulsed:
        return p["alpha_low" if level else "alpha"]
    return p["alpha"] * mp.cos(case.theta)


def pull(case: Case) -> Any:
    """The pull Q, and with no reaction the force P."""
    _, row, y = case.rows()
    return mp.fdot(row, y)


def friction(case: Case) -> Any:
    """Friction of the field's way."""
    p = case.general()
    return {1: p["f_plus"], 0: mpf(0), -1: -p["f_minus"]}[case.field.mode[2]]


def spring(case: Case) -> Any:
    """Force of the stop's spring."""
    p = case.general()
    kappa = (mpf(0), p["beta_1"], p["beta_2"])[case.field.mode[1]]
    return kappa * (case.state[0] - case.stop())


def drive_power(case: Case) -> Any:
    """Power of the drive, of which the capsule takes part unless the drive reacts on it."""
    _, v_r, v_c = case.state
    return drive(case) * (v_r if case.field.form.reacts else v_r + v_c)


FORMULAS: dict[str, Callable[[Case], Any]] = {
    "gap": lambda case: case.state[0] - case.stop(),
    "speed": lambda case: case.state[2],
    "force": lambda case: pull(case) + case.field.form.reacts * drive(case),
    "damper_power": lambda case: 2 * case.parameters["zeta"] * case.state[1] ** 2,
    "drive_power": drive_power,
    "contact": spring,
    "friction": friction,
    "load_force": lambda case: -case.general()["s"],
    "limit": lambda case: pull(case) - friction(case),
    "slip": lambda case: (pull(case) - friction(case)) / case.parameters["gamma"],
}


def differences(formula: Callable[[Case], Any], case: Case, names: tuple[str, ...]) -> list[Any]:
    """Central differences by state, forcing angle and parameters."""

    def moved(at: int, step: Any) -> Any:
        if at < 3:
            state = tuple(value + step * (i == at) for i, value in enumerate(case.state))
            return formula(case._replace(state=state))
        if at == 3:
            return formula(case._replace(theta=case.theta + step))
        name = names[at - 4]
        parameters = {**case.parameters, name: case.parameters[name] + step}
        return formula(case._replace(parameters=parameters))

    return [(moved(i, STEP) - moved(i, -STEP)) / (2 * STEP) for i in range(4 + len(names))]


@pytest.mark.parametrize("name", SCENES)
def test_gradients_are_differences(name: str) -> None:
    given = scene(name)
    with mp.workdps(60):
        for case in cases(name, "weak", 1):
            c, start = case.with_(given.kernels_by(mp))
            known = {**start._asdict(), "way": case.field.mode[2]}
            for of, formula in FORMULAS.items():
                gradient = getattr(c, f"{of}_gradient", None)
                if gradient is None:  # of a term that the scene lacks
                    continue
                wanted = inspect.signature(gradient).parameters
                found = gradient(**{one: known[one] for one in wanted})
                right = differences(formula, case, given.facts.PARAMETERS)
                for a, b in zip(right, found, strict=True):
                    assert abs(a - b) < mpf("1e-30") * (1 + abs(a)), (of, case)
