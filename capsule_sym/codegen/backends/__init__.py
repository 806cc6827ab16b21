"""Backends: for each generated language its spelling and its files."""

from capsule_sym.codegen._backend import Backend
from capsule_sym.codegen.backends.c import C
from capsule_sym.codegen.backends.cython import Cython
from capsule_sym.codegen.backends.matlab import Matlab
from capsule_sym.codegen.backends.mpmath import Mpmath
from capsule_sym.codegen.backends.numpy import NumPy
from capsule_sym.codegen.backends.python import Python
from capsule_sym.codegen.backends.typescript import TypeScript

BACKENDS: tuple[type[Backend], ...] = (Python, NumPy, Mpmath, C, Cython, Matlab, TypeScript)
