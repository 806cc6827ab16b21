"""The system's equations as MathML, which a browser typesets without a script or a network."""

from __future__ import annotations

from typing import Any

from capsule_sym._errors import NotInstalled

EQUATIONS = (
    (
        "Forces between mass and capsule, without and with contact of the second spring",
        r"P_3 = x_r + 2 \zeta v_r, \qquad P_4 = P_3 + \beta (x_r - \delta)",
    ),
    ("Relative motion, in all fields", r"x_r' = v_r"),
    (
        "Stick, F2 and F5, with P_3 and P_4 as P",
        r"v_r' = -P + \alpha \cos \omega \tau, \qquad v_c' = 0, \qquad |P| \le f_b",
    ),
    (
        "Forward drift, F1 and F4",
        r"v_r' = -\frac{\gamma + 1}{\gamma} P + \frac{f_b}{\gamma} + \alpha \cos \omega \tau, "
        r"\qquad v_c' = \frac{P - f_b}{\gamma}",
    ),
    (
        "Backward drift, F3 and F6",
        r"v_r' = -\frac{\gamma + 1}{\gamma} P - \frac{f_b}{\gamma} + \alpha \cos \omega \tau, "
        r"\qquad v_c' = \frac{P + f_b}{\gamma}",
    ),
)
"""What each equation says, and the equation: Eqs. (7)-(12) of the paper."""


def typeset(formula: str) -> Any:
    """A formula of LaTeX as MathML on a line of its own."""
    try:
        from docutils.utils.math.latex2mathml import tex2mathml
        from markupsafe import Markup
    except ModuleNotFoundError as missing:
        raise NotInstalled(missing) from missing
    return Markup(tex2mathml(formula, as_block=True))
