"""The generator: derivations in, source code of the kernels out."""

from pathlib import Path

COMMAND = "python -m capsule_sym.codegen"
INPUTS = Path(__file__).resolve().parents[2] / "codegen"
