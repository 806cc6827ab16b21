"""Fifty digits for switches that doubles cannot decide: by MPFR if gmpy2 is installed.

MPFR takes a tenth of mpmath's time, since each of its numbers is one C object. Its precision is
that of the thread's context, which is set while the digits are in use.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from types import SimpleNamespace
from typing import Any

from capsule_sym._closed_forms import Kernels
from capsule_sym._map.backend import Backend, MpmathBackend, backend
from capsule_sym._parameters import CAPSULE, Scene

try:
    import gmpy2
except ImportError:  # an optional dependency
    gmpy2 = None

_BITS = 203  # the 60 digits of the mpmath backend


@contextmanager
def fifty_digits(scene: Scene = CAPSULE) -> Iterator[Backend]:
    """Number system of a scene with 50 digits and 10 guard digits, for a `with` block."""
    if gmpy2 is None:
        with backend("mpmath", scene) as numbers:
            yield numbers
    else:
        with gmpy2.context(precision=_BITS):
            yield MpfrBackend(scene)


class MpfrBackend(MpmathBackend):
    """Numbers of 203 bits by MPFR, with mpmath's function names."""

    name = "mpfr"

    def __init__(self, scene: Scene = CAPSULE) -> None:
        Backend.__init__(self, _functions(), _kernels(scene), scene)


@cache
def _functions() -> SimpleNamespace:
    def cos_sin(angle: Any) -> tuple[Any, Any]:
        sine, cosine = gmpy2.sin_cos(angle)
        return cosine, sine

    names = ("cos", "exp", "expm1", "sin", "sqrt", "floor", "ceil")
    with gmpy2.context(precision=_BITS):
        return SimpleNamespace(
            **{name: getattr(gmpy2, name) for name in names},
            cos_sin=cos_sin,
            mpf=gmpy2.mpfr,
            prec=_BITS,
            eps=gmpy2.exp2(1 - _BITS),
            pi=gmpy2.const_pi(),
            ldexp=lambda value, power: value * gmpy2.exp2(power),
            log=lambda value, base: gmpy2.log(value) / gmpy2.log(base),
        )


@cache
def _kernels(scene: Scene) -> Kernels:
    return scene.kernels_by(_functions())
