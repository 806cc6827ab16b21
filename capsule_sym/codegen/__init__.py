"""Code generator: source code of the kernels from the derivations; commands of a declaration."""

from pathlib import Path

from capsule_sym._symbolic.model import vocabulary
from capsule_sym._symbolic.model.declaration import Model

__all__ = ["COMMAND", "INPUTS", "Model", "vocabulary"]

COMMAND = "python -m capsule_sym.codegen"
INPUTS = Path(__file__).resolve().parents[2] / "codegen"
