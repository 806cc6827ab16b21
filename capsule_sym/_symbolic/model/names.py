"""Names that a declaration must not use, because generated code uses them."""

from __future__ import annotations

import keyword
import re

_KEYWORDS_TEXT = """
    auto break case catch char classdef const continue default do double else elseif end enum
    extern float for function global goto if inline int long otherwise parfor persistent
    register restrict return short signed sizeof spmd static struct switch try typedef union
    unsigned void volatile while
"""
_KEYWORDS = frozenset(_KEYWORDS_TEXT.split()) | {*keyword.kwlist}
_NAMES_TEXT = """
    Any B B2 B2d BI BW BWd Bd Bdd Constants G G2 G2d Gd H H1 H2 JACOBIAN_COLUMNS K NULL
    Z2 abs advance back before bound bound_of by c cap capsule_advance centre constants contact
    cos cos_theta cosine detached detuning drift drift_change drift_long drift_short drive
    drive_rate exp expm1 fabs fast field flat flow fmax force force_change force_gain2
    force_per_energy forced forced_doubled forced_slopes_apart forced_slopes_doubled forcing_next
    forcing_terms free_doubled free_slopes_apart free_slopes_doubled friction friction_at
    friction_bounds friction_guard front g gain gap guard h i index jacobian jacobian_drift
    jacobian_stick jet jet_magnitudes kappa lag lag2 last len level list lift_force load_force
    loss_at m mad
    margin margin_at max mp mul n name neg next np nu num oscillating over overdamped own p params
    period periods phase pi position position_at pow pull push push_at q range rate reach real
    relative_flow replace response_next rest_centre rest_force resonant root_K second segment
    segment_sizes sigma sign sin sin_theta sine sine2 size_of slow spring sqrt start state stop sub
    tau term theta to_dict total turning_velocity u u1 v_c v_c_rate v_change v_r v_rate v_second
    v_x values velocity velocity_at versine versine2 w way width x_c x_change x_r
"""
_NAMES = frozenset(_NAMES_TEXT.split())
"""Names with another meaning in generated code and derivations."""
_NUMBERED = re.compile(r"(t|x|p|P_|drive|abs_[xp])\d*|(abs|by|d\d)_\w+|\w+_(gradient|size)")
_OF_DEVICES_TEXT = """
    acceleration dimensionless displacement energy force friction_force length_scale
    natural_frequency phase ratios scale sqrt tie time v_c v_r velocity x_c x_r
"""
_OF_DEVICES = frozenset(_OF_DEVICES_TEXT.split())
"""Names that a device has besides its quantities, and those of the start."""


def problem(name: str, kind: str) -> str:
    """Reason why a "parameter", "quantity" or another kind must not have this name, or ""."""
    if not re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII) or name in _KEYWORDS:
        return f"{name!r} is no name in C, Python and MATLAB"
    taken = {
        "parameter": name in _NAMES or bool(_NUMBERED.fullmatch(name)),
        "quantity": name in _OF_DEVICES,
    }
    return f"the name {name} is in use for something else" if taken.get(kind) else ""
