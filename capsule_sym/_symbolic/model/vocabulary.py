"""Quantities, units and parameters that declarations share, by the parts of a capsule.

Each has the facts of a method of `Model`: with a `measure` it is a quantity of the device in SI
units, with a `relation` a unit of results, else a dimensionless parameter with its relation `si`
to the device. A relation is text, computed in the order in which it is written. A scene chooses
parts and gives values; a part of its own replaces single facts.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Part = Mapping[str, Mapping[str, Any]]
"""Facts of quantities, units and parameters, by their names."""

_ANY_SIGN = (-1e10, 1e10)
_SHARE = (1e-9, 1 - 1e-9)

# fmt: off
BODIES: Part = {
    "M_m": dict(
        measure="kg", between=(1e-9, 1e9), label="inner mass",
        about="Mass that moves inside the capsule.", slider=(0.01, 5, 0.01)),
    "M_c": dict(
        measure="kg", between=(1e-9, 1e9), label="mass of the capsule",
        about="Mass of the capsule without the inner mass.", slider=(0.01, 10, 0.01)),
    "k1": dict(
        measure="N/m", between=(1e-9, 1e12), label="stiffness of the spring", letter="k₁",
        about="Stiffness of the spring between mass and capsule.", slider=(1, 500, 0.1)),
    "c": dict(
        measure="N s/m", between=(0, 1e9), label="damping coefficient",
        about="Damping coefficient between mass and capsule.", slider=(0, 10, 0.01)),
    "g": dict(
        measure="m/s^2", between=(1e-9, 1e6), optional=True, label="gravitational acceleration",
        about="Gravitational acceleration.", slider=(0.1, 30, 0.01)),
    "natural_frequency": dict(
        letter="Omega0", relation="sqrt(k1 / M_m)", about="Natural frequency, the unit of rates"),
    "length_scale": dict(
        letter="x_0", relation="P_f / k1",
        about="Length that friction stretches the spring, the unit"),
    "zeta": dict(
        between=(0, 1e4), label="damping ratio",
        si="c / (M_m * Omega0) / 2", definition="c / (2 M_m Omega0)",
        about="Damping between mass and capsule, over twice M_m √(k₁/M_m); 1 is critical.",
        letter="ζ", tex=r"\zeta", slider=(0, 1, 0.001)),
    "gamma": dict(
        between=(1e-8, 1e8), label="mass ratio", si="M_c / M_m",
        about="Mass of the capsule over the inner mass: M_c / M_m.",
        letter="γ", tex=r"\gamma", slider=(0.2, 8, 0.01)),
}
"""The mass and the capsule, with spring and damper between them."""


def harmonic(acts: str = "that drives the inner mass") -> Part:
    """A cosine drive; its texts have `acts` after the word "force": "between both bodies"."""
    return {
        "P_d": dict(
            measure="N", between=(0, 1e9), label="amplitude of the excitation",
            about=f"Amplitude of the force {acts}.", slider=(0, 20, 0.01)),
        "Omega": dict(
            measure="rad/s", between=(1e-9, 1e9), label="frequency of the excitation", letter="Ω",
            about="Angular frequency of the driving force.", slider=(0.1, 50, 0.01)),
        "alpha": dict(
            between=(0, 1e10), label="excitation amplitude", si="P_d / P_f",
            about=f"Amplitude of the force {acts}, over the friction force: P_d / P_f.",
            letter="α", tex=r"\alpha", slider=(0, 2, 0.001)),
        "omega": dict(
            between=(1e-6, 1e6), label="excitation frequency", si="Omega / Omega0",
            about="Frequency of the driving force, over the natural frequency √(k₁/M_m) of the "
            "inner mass.", letter="ω", tex=r"\omega", slider=(0.1, 3, 0.001)),
    }


ONE_STOP: Part = {
    "k2": dict(
        measure="N/m", between=(0, 1e12), label="stiffness of the second spring", letter="k₂",
        about="Stiffness of the spring that the mass meets after the gap.", slider=(0, 1000, 0.1)),
    "G": dict(
        measure="m", between=(0, 1e6), label="gap",
        about="Distance between the mass at rest and the second spring.", slider=(0, 0.1, 0.0001)),
    "delta": dict(
        between=(0, 1e10), label="gap", si="k1 * G / P_f",
        about="Distance at which the inner mass meets the second spring, over the length P_f / k₁.",
        letter="δ", tex=r"\delta", slider=(0, 1, 0.001)),
    "beta": dict(
        between=(0, 1e10), label="stiffness ratio", si="k2 / k1",
        about="Stiffness of the second spring over that of the first: k₂ / k₁.",
        letter="β", tex=r"\beta", slider=(0, 20, 0.01)),
}
"""A second spring in front, behind a gap."""

FRICTION: Part = {
    "mu": dict(
        measure="", between=(1e-9, 1e6), label="friction coefficient", letter="μ",
        about="Coulomb friction between the capsule and what it lies on.", slider=(0.01, 2, 0.001)),
    "friction_force": dict(
        letter="P_f", relation="mu * (M_m + M_c) * g",
        about="Coulomb friction, the unit of force"),
    "f_b": dict(
        between=(1e-10, 1e10), label="friction bound",
        si="1", definition="max|F_r| / P_f; 1 for dry friction",
        about="Largest friction force over P_f: 1 for dry friction.", slider=(0.1, 2, 0.01)),
}
"""Dry friction on level ground, the same forward and backward."""


def pulses(acts: str = "that drives the inner mass") -> Part:
    """A drive of two levels; its texts have `acts` after the word "force"."""
    return {
        "P_d": dict(
            measure="N", between=(0, 1e9), label="force of the pulse",
            about=f"Force {acts} while the pulse lasts.", slider=(0, 20, 0.01)),
        "P_low": dict(
            measure="N", between=(-1e9, 1e9), label="force between pulses", letter="P_l",
            about=f"Force {acts} in the rest of a period.", slider=(-20, 20, 0.01)),
        "duty": dict(
            measure="", between=_SHARE, label="duty cycle", letter="D",
            about="Part of a period in which the pulse lasts.", slider=(0.01, 0.99, 0.001)),
        "Omega": dict(
            measure="rad/s", between=(1e-9, 1e9), label="frequency of the pulses", letter="Ω",
            about="Angular frequency of the pulses.", slider=(0.1, 50, 0.01)),
        "alpha": dict(
            between=(0, 1e10), label="force of the pulse", si="P_d / P_f",
            about=f"Force {acts} while the pulse lasts, over the friction force: P_d / P_f.",
            letter="α", tex=r"\alpha", slider=(0, 2, 0.001)),
        "alpha_low": dict(
            between=_ANY_SIGN, label="force between pulses", si="P_low / P_f",
            about=f"Force {acts} in the rest of a period, over the friction force.",
            letter="α_l", tex=r"\alpha_l", slider=(-2, 2, 0.001)),
        "D": dict(
            between=_SHARE, label="duty cycle", si="duty",
            about="Part of a period in which the pulse lasts.", slider=(0.01, 0.99, 0.001)),
        "omega": dict(
            between=(1e-6, 1e6), label="frequency of the pulses", si="Omega / Omega0",
            about="Frequency of the pulses, over the natural frequency √(k₁/M_m) of the inner "
            "mass.", letter="ω", tex=r"\omega", slider=(0.1, 3, 0.001)),
    }


TWO_STOPS: Part = {
    "k_front": dict(
        measure="N/m", between=(0, 1e12), label="stiffness of the stop in front", letter="k₊",
        about="Stiffness of the stop that the mass meets in front.", slider=(0, 100000, 100)),
    "k_back": dict(
        measure="N/m", between=(0, 1e12), label="stiffness of the stop behind", letter="k₋",
        about="Stiffness of the stop that the mass meets behind.", slider=(0, 100000, 100)),
    "G_front": dict(
        measure="m", between=(0, 1e6), label="gap in front", letter="G₊",
        about="Distance from the mass at rest to the stop in front, without preload.",
        slider=(0, 0.01, 0.0001)),
    "G_back": dict(
        measure="m", between=(0, 1e6), label="gap behind", letter="G₋",
        about="Distance from the mass at rest to the stop behind, without preload.",
        slider=(0, 0.01, 0.0001)),
    "preload": dict(
        measure="N", between=(-1e9, 1e9), optional=True, label="preload of the spring", letter="F₀",
        about="Force by which the spring pulls the mass backward from where the gaps are measured.",
        slider=(-0.1, 0.1, 0.001)),
    "delta_1": dict(
        between=(0, 1e10), label="gap in front", si="(k1 * G_front + preload) / P_f",
        about="Distance at which the inner mass meets the stop in front, over the length P_f / k₁.",
        letter="δ₁", tex=r"\delta_1", slider=(0, 30, 0.01)),
    "delta_2": dict(
        between=(0, 1e10), label="gap behind", si="(k1 * G_back - preload) / P_f",
        about="Distance at which the inner mass meets the stop behind, over the length P_f / k₁.",
        letter="δ₂", tex=r"\delta_2", slider=(0, 30, 0.01)),
    "beta_1": dict(
        between=(0, 1e10), label="stiffness ratio in front", si="k_front / k1",
        about="Stiffness of the stop in front over that of the spring.",
        letter="β₁", tex=r"\beta_1", slider=(0, 1000, 1)),
    "beta_2": dict(
        between=(0, 1e10), label="stiffness ratio behind", si="k_back / k1",
        about="Stiffness of the stop behind over that of the spring.",
        letter="β₂", tex=r"\beta_2", slider=(0, 1000, 1)),
}
"""A stop in front and one behind, each after its gap."""

SLOPE: Part = {
    "mu": dict(
        measure="", between=(1e-9, 1e6), label="friction coefficient forward", letter="μ",
        about="Coulomb friction where the capsule moves forward.", slider=(0.01, 2, 0.001)),
    "mu_back": dict(
        measure="", between=(1e-9, 1e6), label="friction coefficient backward", letter="μ₋",
        about="Coulomb friction where the capsule moves backward.", slider=(0.01, 2, 0.001)),
    "slope": dict(
        measure="", between=(-1e6, 1e6), optional=True, label="slope",
        about="Slope of the track, its rise over its run, upward in the forward direction.",
        slider=(-0.2, 0.2, 0.001)),
    "friction_force": dict(
        letter="P_f", relation="mu * (M_m + M_c) * g / sqrt(1 + slope * slope)",
        about="Friction on the slope"),
    "s": dict(
        between=_ANY_SIGN, label="bias on the mass", si="slope / (mu * (1 + gamma))",
        about="Pull of gravity on the inner mass down the slope, over the friction force.",
        slider=(-0.3, 0.3, 0.001)),
    "f_plus": dict(
        between=(1e-10, 1e10), label="friction bound forward", si="1 + gamma * s",
        about="Force that moves the capsule up the slope, over the friction force.",
        letter="f₊", tex="f_+", slider=(0.1, 2, 0.001)),
    "f_minus": dict(
        between=(1e-10, 1e10), label="friction bound backward", si="mu_back / mu - gamma * s",
        about="Force that moves the capsule down the slope, over the friction force. Where it is "
        "not above 0, the capsule slips down by itself and never rests.",
        letter="f₋", tex="f_-", slider=(0.1, 2, 0.001)),
}
"""Gravity along the track, and friction that differs with the direction."""
# fmt: on
