"""NumPy: kernels over arrays of segments."""

from typing import ClassVar

from capsule_sym.codegen.backends.python.spelling import PythonKernels


class NumPy(PythonKernels):
    """Kernels in double precision, over lanes."""

    files: ClassVar = {"py/kernels.py": "kernels.py.in", "py/__init__.py": "init.py.in"}
