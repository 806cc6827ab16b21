"""Functions on many-digit numbers for the mpmath kernels, and these kernels.

mpmath's own context is global: its precision is the user's, and any thread may change it at any
time. This module has a context of its own, whose precision is set once, so that runs in all threads
share it safely. It neither reads nor changes `mpmath.mp`. (A context for each run would also work,
but its numbers could not be pickled. Only those functions of mpmath are used that do not raise the
precision of their context for a while; others need a `workspace`.)
"""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any

from mpmath import MPContext
from mpmath.libmp.libelefun import ln2_fixed, pi_fixed

from capsule_sym._closed_forms import Kernels
from capsule_sym._map.promised import MOST_DIGITS
from capsule_sym._parameters import CAPSULE, Scene

_WARM_BITS = 4096

# mpmath caches pi and ln 2 to the most bits requested so far, in two steps between which another
# thread reads nonsense. More bits than any run needs are computed here, at import.
pi_fixed(_WARM_BITS)
ln2_fixed(_WARM_BITS)


def workspace(digits: int = MOST_DIGITS) -> Any:
    """Context of mpmath for one caller, for functions that change its precision."""
    context = MPContext()
    context.dps = digits
    return context


@cache
def of_mpmath(digits: int) -> SimpleNamespace:
    """Functions by mpmath, in numbers with this many digits."""
    context = workspace(digits)

    def expm1(x: Any) -> Any:
        # mpmath's own raises the precision of its context.
        if context.mag(x) < -context.prec:
            return x + x * x / 2
        return context.exp(x, prec=context.prec + 10 + max(0, -context.mag(x))) - 1

    names = ("cos", "exp", "sin", "sqrt", "cos_sin", "floor", "ceil", "ldexp", "log", "mpf")
    functions = {name: getattr(context, name) for name in names}
    constants = {"prec": context.prec, "eps": +context.eps, "pi": +context.pi}
    return SimpleNamespace(expm1=expm1, **functions, **constants)


mpf = of_mpmath(MOST_DIGITS).mpf
"""Numbers of a run with the backend `mpmath`."""
# So that pickle finds the class.
mpf.__module__, mpf.__qualname__ = __name__, "mpf"


@cache
def mpmath_kernels(digits: int, scene: Scene = CAPSULE) -> Kernels:
    """Kernels of a scene in numbers with this many digits."""
    return scene.kernels_by(of_mpmath(digits))
