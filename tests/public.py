"""All public names, of the package and of its modules."""

from importlib import import_module
from typing import Any

FOLDERS = ("figures", "inputs", "orbits", "results")
MODULES = ("capsule_sym", *(f"capsule_sym.{name}" for name in FOLDERS))
HOMES = {
    name: module
    for module in MODULES
    for name in import_module(module).__all__
    if name not in (*FOLDERS, "scenes", "__version__")
}
"""Module of each name."""
PUBLIC: dict[str, Any] = {name: getattr(import_module(home), name) for name, home in HOMES.items()}
