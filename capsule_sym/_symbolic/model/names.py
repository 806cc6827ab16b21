"""Names that a declaration must not use: of languages, generated code, commands and results."""

from __future__ import annotations

import keyword
import re

from sympy.printing.cxx import reserved


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


_KEYWORDS = _words("""
    catch cdef cimport classdef cpdef ctypedef debugger elseif end function implements include
    instanceof interface let null otherwise package parfor persistent restrict spmd super typeof
    typeof_unqual undefined var
""").union(keyword.kwlist, keyword.softkwlist, *reserved.values())
_MACROS = _words("""
    I Infinity L_ctermid L_tmpnam NaN P_tmpdir assert complex environ errno far fpclassify huge i386
    imaginary isfinite isinf isnan isnormal linux math_errhandling near noreturn offsetof
    sched_priority signbit signgam small st_atime st_ctime st_mtime stderr stdin stdout unix va_arg
    va_end va_start
""")
_MACRO = re.compile(
    rf"{'|'.join(_MACROS)}|(?=.*[A-Z].*[A-Z])[A-Z0-9_]+l?|Py[A-Z_]\w*"
    r"|(PRI|SCN)[a-z]\w*|(u?int|size|ptrdiff)\w*_t"
)
"""Macros and types of C's headers and Python's, and names of 2 or more capitals, as macros are."""
_NAMES = _words("""
    Any B B2 B2d BI BW BWd Bd Bdd Constants G G2 G2d Gd H H1 H2 JACOBIAN_COLUMNS K NULL Z2 abs add
    advance back before bound bound_of by c cap capsule_advance centre constants contact cos
    cos_theta cosine damper_power detached detuning drift drift_change drift_long drift_short drive
    drive_level drive_power drive_rate exp expm1 fabs fast field flat flow fmax force force_change
    force_gain2 force_per_energy forced forced_doubled forced_slopes_apart forced_slopes_doubled
    forcing_next forcing_terms free_doubled free_slopes_apart free_slopes_doubled friction
    friction_at friction_bounds friction_guard front g gain gap guard h high high_share i index
    jacobian jacobian_drift jacobian_stick jet jet_magnitudes kappa lag lag2 last len level
    lift_force list load_force loss_at m mad margin margin_at max mp mul n name neg next np nu num
    oscillating over overdamped own own_constants own_stop p params period periods phase pi position
    position_at pow pull pull_rate push push_at q range rate reach real relative_flow replace
    resonant response_next rest_centre rest_force root_K second segment segment_sizes sigma sign sin
    sin_theta sine sine2 size_of slow spring sqrt start state stop sub tau term theta to_dict total
    turning_velocity u u1 v_c v_c_rate v_change v_r v_rate v_x values velocity velocity_at
    versine versine2 w way width x_c x_change x_r
""")
"""Names with another meaning in generated code and derivations; for parameters alone."""
_NUMBERED = re.compile(r"(t|x|p|P_|drive|abs_[xp])\d*|(abs|by|d\d)_\w+|\w+_(gradient|size)")
_OF_DEVICES = _words("""
    acceleration dimensionless displacement energy force friction_force length_scale
    natural_frequency phase rate ratios replace scale scene sqrt tie time to_dict v_c v_r velocity
    x_c x_r
""")
"""Names that a device has besides its quantities, and those of the start."""
_OF_RESULTS = _words("""
    against all along among any_core as_json at attractor backend between bifurcation cascade
    certify check colours component compute count curve curves damper_loss data dpi everything
    file final friction_loss help info intervals itinerary json kind largest least leaving loss
    lyapunov max_periods max_seconds maximise metric minimise most_periods multiplier
    multipliers normal of only open opens out outcome pareto peak_contact peak_force
    period_number plan points port progression quantity restart resume reverse samples scene
    seed serve shares starts store subject_to subjects switches threads ties to tolerance
    tolerances unknown weights work workers xlim ylim
""")
"""Names of options of commands and of results of sweeps."""


def problem(name: str, kind: str) -> str:
    """Reason why a "parameter", a "quantity" or a "mode" must not have this name, or "".

    The letter of a unit is checked as a "quantity", the name of a region as a "mode".
    """
    if not re.fullmatch(r"[A-Za-z]\w*", str(name), re.ASCII) or name in _KEYWORDS:
        return f"{name!r} is no name in C, Python, TypeScript and MATLAB"
    if (kind == "parameter" and (name in _NAMES | _OF_RESULTS or _NUMBERED.fullmatch(name))) or (
        kind == "quantity" and name in _OF_DEVICES | _OF_RESULTS
    ):
        return f"the name {name} is in use for something else"
    macro = kind != "mode" and _MACRO.fullmatch(name)
    return f"the name {name} is that of a macro or a type in C" if macro else ""
