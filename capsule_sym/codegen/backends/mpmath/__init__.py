"""mpmath: kernels in any number of digits."""

from typing import ClassVar

from capsule_sym.codegen.backends.python.spelling import PythonKernels


class Mpmath(PythonKernels):
    """Kernels at the working precision."""

    files: ClassVar = {"mp/kernels.py": "kernels.py.in", "mp/__init__.py": "init.py.in"}
