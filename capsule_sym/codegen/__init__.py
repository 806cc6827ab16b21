"""Code generator: source code of the kernels from the derivations; names for declarations."""

from pathlib import Path

TYPE_CHECKING = False
if TYPE_CHECKING:
    from capsule_sym._symbolic.model import vocabulary
    from capsule_sym._symbolic.model.declaration import Model

__all__ = ["COMMAND", "INPUTS", "Model", "vocabulary"]

COMMAND = "python -m capsule_sym.codegen"
_HERE = Path(__file__).resolve().parent
INPUTS = _HERE / "inputs" if (_HERE / "inputs").is_dir() else _HERE.parents[1] / "codegen"
"""Folder of the generator's tables, which the build puts into an installed package."""


def __getattr__(name: str) -> object:
    """`Model` and `vocabulary`, which need SymPy; raises NotInstalled without it."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        from capsule_sym._symbolic.model import declaration, vocabulary
    except ModuleNotFoundError as missing:
        from capsule_sym._errors import NotInstalled

        raise NotInstalled(missing) from missing
    return vocabulary if name == "vocabulary" else declaration.Model
