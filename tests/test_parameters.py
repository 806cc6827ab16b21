"""Validation and scaling, against the table of Section 2 in exact and 50-digit arithmetic."""

import math
import pickle
import sys
from dataclasses import FrozenInstanceError, fields
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import capsule_sym as cs

CASE_STUDY = {
    "alpha": 0.7,
    "omega": 0.8,
    "delta": 0.02,
    "zeta": 0.05,
    "beta": 1.5,
    "gamma": 3.3,
    "f_b": 1.0,
}
DEVICE = {
    "M_m": 0.2,
    "M_c": 0.5,
    "k1": 80.0,
    "k2": 160.0,
    "c": 0.4,
    "G": 0.001,
    "P_d": 1.5,
    "Omega": 16.0,
    "mu": 0.3,
    "g": 10.0,
}
UNIT_ROUNDOFF = 2.0**-53
POSITIVE = {"omega", "gamma", "f_b", "M_m", "M_c", "k1", "Omega", "mu", "g"}
BOTH_KINDS = [(cs.Parameters, CASE_STUDY), (cs.PhysicalParameters, DEVICE)]
EVERY_FIELD = [
    pytest.param(kind, values, name, id=f"{kind.__name__}-{name}")
    for kind, values in BOTH_KINDS
    for name in values
]

moderate = st.floats(1e-6, 1e6)
devices = st.builds(cs.PhysicalParameters, **dict.fromkeys(DEVICE, moderate))


def close(actual: float, expected: mpmath.mpf) -> bool:
    """Equal but for the few roundings of a product, a quotient and a square root."""
    return abs(actual - expected) <= 8 * UNIT_ROUNDOFF * abs(expected)


def test_defaults_are_the_case_study_in_order() -> None:
    assert list(cs.Parameters().to_dict().items()) == list(CASE_STUDY.items())
    assert [field.name for field in fields(cs.PhysicalParameters)] == list(DEVICE)
    del (without_g := dict(DEVICE))["g"]
    assert cs.PhysicalParameters(**without_g).g == 9.81


@pytest.mark.parametrize(("kind", "values"), BOTH_KINDS)
def test_parameters_cannot_change(kind: type, values: dict[str, float]) -> None:
    parameters = kind(**values)
    for name in values:
        with pytest.raises(FrozenInstanceError):
            setattr(parameters, name, 2.0)
    assert not hasattr(parameters, "__dict__")
    assert pickle.loads(pickle.dumps(parameters)) == parameters
    assert hash(kind(**values)) == hash(parameters)


@pytest.mark.parametrize("value", [2, np.int64(2), np.float32(2), np.float64(2)])
@pytest.mark.parametrize(("kind", "values", "name"), EVERY_FIELD)
def test_every_real_number_becomes_a_float(kind, values, name, value) -> None:
    stored = getattr(kind(**values | {name: value}), name)
    assert type(stored) is float
    assert stored == 2.0


@pytest.mark.parametrize(
    "value",
    [
        True,
        np.True_,
        "1.0",
        b"1",
        None,
        1 + 0j,
        np.complex128(1),
        [1.0],
        np.array([1.0]),
        Decimal(1),
        Fraction(1, 3),
        mpmath.mpf(1),
    ],
    ids=repr,
)
@pytest.mark.parametrize(("kind", "values", "name"), EVERY_FIELD)
def test_what_is_no_real_number_is_refused(kind, values, name, value) -> None:
    with pytest.raises(cs.InvalidInput) as caught:
        kind(**values | {name: value})
    bound = "> 0" if name in POSITIVE else ">= 0"
    assert str(caught.value) == f"{name} = {value!r}: must be a real number, finite and {bound}"
    assert caught.value.value is value


@pytest.mark.parametrize(
    "value", [math.nan, math.inf, -math.inf, -0.1, -5e-324, np.float32("nan"), 10**400, -(10**400)]
)
@pytest.mark.parametrize(("kind", "values", "name"), EVERY_FIELD)
def test_what_is_out_of_range_is_refused(kind, values, name, value) -> None:
    with pytest.raises(cs.InvalidInput) as caught:
        kind(**values | {name: value})
    assert caught.value.field == name
    assert not 0 <= caught.value.value < sys.float_info.max
    assert (caught.value.value < 0) == (value < 0)
    bound = "finite and > 0" if name in POSITIVE else "finite and >= 0"
    assert caught.value.allowed == "a real number, " * isinstance(value, int) + bound


@pytest.mark.parametrize(("kind", "values", "name"), EVERY_FIELD)
def test_zero_is_allowed_exactly_where_it_makes_sense(kind, values, name) -> None:
    zero = values | {name: 0.0}
    if name in POSITIVE:
        with pytest.raises(cs.InvalidInput, match=rf"^{name} = 0\.0: must be finite and > 0$"):
            kind(**zero)
    else:
        assert getattr(kind(**zero), name) == 0.0


def test_an_error_says_field_value_and_range_and_survives_pickling() -> None:
    with pytest.raises(ValueError, match=r"^zeta = -0\.1: must be finite and >= 0$") as caught:
        cs.Parameters(zeta=-0.1)
    error = caught.value
    assert isinstance(error, cs.CapsuleError)
    copy = pickle.loads(pickle.dumps(error))
    assert type(copy) is cs.InvalidInput
    assert (copy.field, copy.value, copy.allowed) == ("zeta", -0.1, "finite and >= 0")
    assert str(copy) == str(error)


def test_replace_changes_what_is_named_and_validates() -> None:
    changed = cs.Parameters().replace(alpha=1.9, gamma=3)
    assert changed.to_dict() == CASE_STUDY | {"alpha": 1.9, "gamma": 3.0}
    assert cs.Parameters(**changed.to_dict()) == changed
    with pytest.raises(cs.InvalidInput, match=r"^omega = 0\.0: must be finite and > 0$"):
        cs.Parameters().replace(omega=0)
    with pytest.raises(cs.InvalidInput) as caught:
        cs.Parameters().replace(zet=0.1)
    assert str(caught.value) == (
        "parameter = 'zet': must be one of alpha, omega, delta, zeta, beta, gamma, f_b; "
        "did you mean zeta?"
    )


@given(omega=moderate)
def test_the_forcing_turns_once_in_a_period(omega: float) -> None:
    with mpmath.workdps(50):
        turn = mpmath.mpf(omega) * mpmath.mpf(cs.Parameters(omega=omega).period)
        assert close(2.0, turn / mpmath.pi)


@given(devices)
def test_scaling_follows_the_table_of_section_2(device: cs.PhysicalParameters) -> None:
    with mpmath.workdps(50):
        M_m, M_c, k1, k2, c, G, P_d, Omega, mu, g = (
            mpmath.mpf(getattr(device, name)) for name in DEVICE
        )
        Omega0 = mpmath.sqrt(k1 / M_m)
        P_f = mu * (M_m + M_c) * g
        assert close(device.natural_frequency, Omega0)
        assert close(device.friction_force, P_f)
        scaled = device.dimensionless()
        assert close(scaled.alpha, P_d / P_f)
        assert close(scaled.omega, Omega / Omega0)
        assert close(scaled.delta, k1 * G / P_f)
        assert close(scaled.zeta, c / (2 * M_m * Omega0))
        assert close(scaled.beta, k2 / k1)
        assert close(scaled.gamma, M_c / M_m)
        assert scaled.f_b == 1.0
        # x = k1 X / P_f, v = k1 V / (Omega0 P_f), tau = Omega0 t.
        assert close(1.0, k1 * mpmath.mpf(device.scale("x_r")) / P_f)
        assert close(1.0, k1 * mpmath.mpf(device.scale("velocity")) / (Omega0 * P_f))
        assert close(1.0, Omega0 * mpmath.mpf(device.scale("duration")))


@given(device=devices, x_r=st.floats(-10, 10), v_r=st.floats(-10, 10), tau=st.floats(0, 10))
def test_newtons_equation_in_si_units_is_the_scaled_one(device, x_r, v_r, tau) -> None:
    """Eq. (11), contact and stick: M_m A = P_d cos(Omega t) - k1 X - c V - k2 (X - G)."""
    scaled = device.dimensionless()
    forces = (
        device.P_d * math.cos(device.Omega * device.scale("duration") * tau),
        -device.k1 * device.scale("x_r") * x_r,
        -device.c * device.scale("velocity") * v_r,
        -device.k2 * device.scale("x_r") * x_r,
        device.k2 * device.G,
    )
    spring = scaled.beta * (x_r - scaled.delta)
    acceleration = (
        scaled.alpha * math.cos(scaled.omega * tau) - x_r - 2 * scaled.zeta * v_r - spring
    )
    # The phase carries a rounding of its own size, which the cosine passes on to the force.
    size = sum(map(abs, forces)) + device.P_d * scaled.omega * tau
    rate = device.scale("velocity") * device.natural_frequency
    assert abs(device.M_m * rate * acceleration - sum(forces)) <= 16 * UNIT_ROUNDOFF * size


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"mu": 1e-200, "g": 1e-200}, "friction_force"),
        ({"mu": 1e200, "g": 1e200}, "friction_force"),
        ({"M_m": 1e300, "k1": 1e-300}, "natural_frequency"),
        ({"M_m": 1e-300, "k1": 1e300}, "natural_frequency"),
        ({"mu": 1e-100, "k1": 1e250}, "length_scale"),
        ({"P_d": 1e300, "mu": 1e-20}, "P_d"),
        ({"M_c": 1e-300, "M_m": 1e300, "mu": 1e-290}, "gamma"),
    ],
)
def test_a_device_beyond_double_precision_is_refused(changes: dict[str, float], field: str) -> None:
    with pytest.raises(cs.InvalidInput) as caught:
        cs.PhysicalParameters(**DEVICE | changes)
    assert caught.value.field == field


class TestFile:
    def load(self, folder: Path, text: str) -> cs.Parameters | cs.PhysicalParameters:
        file = folder / "parameters.toml"
        file.write_text(text, encoding="utf-8")
        return cs.load_parameters(file)

    def refusal(self, folder: Path, text: str) -> str:
        with pytest.raises(cs.InvalidInput) as caught:
            self.load(folder, text)
        return str(caught.value)

    def test_dimensionless_keys_complete_the_case_study(self, tmp_path: Path) -> None:
        loaded = self.load(tmp_path, "alpha = 1.9  # strong\ngamma = 3\n")
        assert loaded == cs.Parameters(alpha=1.9, gamma=3.0)
        assert self.load(tmp_path, "") == cs.Parameters()

    def test_physical_keys_give_a_device(self, tmp_path: Path) -> None:
        text = "".join(f"{name} = {value}\n" for name, value in DEVICE.items())
        assert self.load(tmp_path, text) == cs.PhysicalParameters(**DEVICE)
        without_g = text.replace("g = 10.0\n", "")
        assert self.load(tmp_path, without_g) == cs.PhysicalParameters(**DEVICE | {"g": 9.81})

    @pytest.mark.parametrize("missing", [{"M_m"}, {"G", "k1"}, DEVICE.keys() - {"g"}])
    def test_all_missing_physical_keys_are_named(self, tmp_path: Path, missing: set[str]) -> None:
        kept = {name: value for name, value in DEVICE.items() if name not in missing}
        text = "".join(f"{name} = {value}\n" for name, value in kept.items())
        order = ("M_m", "M_c", "k1", "k2", "c", "G", "P_d", "Omega", "mu")
        named = ", ".join(name for name in order if name in missing)
        assert self.refusal(tmp_path, text).endswith(f"must be a whole device, with {named} too")

    def test_a_mix_is_refused(self, tmp_path: Path) -> None:
        assert self.refusal(tmp_path, "alpha = 0.7\nk1 = 80.0\n") == (
            "alpha = 0.7: must be absent where k1 is given in SI units"
        )

    @pytest.mark.parametrize("text", ["zet = 0.1", "[zet]\nalpha = 1.0", "zet = 1.0\nk1 = 80.0"])
    def test_an_unknown_key_is_refused(self, tmp_path: Path, text: str) -> None:
        assert self.refusal(tmp_path, text) == (
            "parameter = 'zet': must be one of alpha, omega, delta, zeta, beta, gamma, f_b, "
            "or of M_m, M_c, k1, k2, c, G, P_d, Omega, mu, g; did you mean zeta?"
        )

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ("alpha = '0.7'", "alpha = '0.7': must be a real number, finite and >= 0"),
            ("alpha = true", "alpha = True: must be a real number, finite and >= 0"),
            ("alpha = [0.7]", "alpha = [0.7]: must be a real number, finite and >= 0"),
            ("alpha = nan", "alpha = nan: must be finite and >= 0"),
            ("omega = -inf", "omega = -inf: must be finite and > 0"),
        ],
    )
    def test_a_bad_value_is_refused(self, tmp_path: Path, text: str, message: str) -> None:
        assert self.refusal(tmp_path, text) == message

    @pytest.mark.parametrize(
        "content", [b"alpha = ", b"alpha: 0.7", b"alpha = 1\nalpha = 2", b"\xff"]
    )
    def test_what_is_not_toml_is_refused(self, tmp_path: Path, content: bytes) -> None:
        file = tmp_path / "parameters.toml"
        file.write_bytes(content)
        with pytest.raises(cs.InvalidInput) as caught:
            cs.load_parameters(file)
        assert str(caught.value).startswith(f"file = '{file}': must be a TOML file (")

    def test_an_unreadable_file_is_refused(self, tmp_path: Path) -> None:
        missing = tmp_path / "missing.toml"
        with pytest.raises(cs.InvalidInput) as caught:
            cs.load_parameters(str(missing))
        assert str(caught.value) == (
            f"file = '{missing}': must be readable (No such file or directory)"
        )
        with pytest.raises(cs.InvalidInput, match="must be readable"):
            cs.load_parameters(tmp_path)


@pytest.mark.parametrize("share", [1.0, 1.5, 1e-12])
def test_a_duty_cycle_is_a_share_of_the_period(share: float) -> None:
    with pytest.raises(cs.InvalidInput, match=rf"D = {share!r}: must be in \[1e-09, 0.999999999\]"):
        cs.scenes.prototype.Parameters(D=share)
    with pytest.raises(cs.InvalidInput, match="D = "):
        cs.scenes.prototype.Parameters().replace(D=share)
