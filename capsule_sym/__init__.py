"""The exact three-dimensional map of a piecewise-linear capsule system with bidirectional drifts.

All public names are imported on first use, so importing the package costs almost nothing. They are
listed in `__init__.pyi`, which type checkers read as well. Further ones are in `figures`, `inputs`,
`orbits`, `results` and `scenes`.
"""

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

# Not a cache of functools: its import would come before Ctrl-C has its handler in `__main__`.
_homes: dict[str, dict[str, str]] = {}


def _names_of(module: str, loader: "Any", file: str) -> dict[str, str]:
    """Module behind each name of the stub beside a public module; "" for a public module."""
    if module not in _homes:
        import re

        # The loader finds it in an archive too, and pathlib takes longer to import.
        stub = loader.get_data(f"{file.rpartition('.')[0]}.pyi").decode()
        found = re.findall(r"from capsule_sym\.?(\S*) import \(?\s*(\w+) as", stub)
        _homes[module] = {name: home for home, name in found}
    return _homes[module]


def _attach(
    module: str, loader: "Any", file: str
) -> "tuple[Callable[..., Any], Callable[..., Any]]":
    """The functions `__getattr__` and `__dir__` of a public module."""

    def get(name: str) -> object:
        import sys

        known = _names_of(module, loader, file)
        if name == "__all__":  # a missing dependency would make the whole `import *` fail
            return [one for one in sorted(known) if _works(sys.modules[module], one)]
        if name not in known:
            from capsule_sym._errors import suggestion

            homes = "; others are in its modules figures, inputs, orbits and results"
            more = suggestion(name, known) or homes * (module == __name__)
            raise AttributeError(f"module {module!r} has no attribute {name!r}{more}")
        found = _imported(module, known[name], name)
        setattr(sys.modules[module], name, found)
        return found

    return get, lambda: sorted(_names_of(module, loader, file))


def _imported(public: str, home: str, name: str) -> object:
    """A name of a module; functions check their arguments."""
    from importlib import import_module

    try:
        if not home:
            return import_module(f"capsule_sym.{name}")
        found: object = getattr(import_module(f"capsule_sym.{home}"), name)
    except ModuleNotFoundError as missing:
        if str(missing.name).startswith("capsule_sym"):
            raise
        from capsule_sym._errors import NotInstalled

        raise NotInstalled(missing) from missing
    if isinstance(found, type(_attach)):  # a function
        from capsule_sym._arguments import checked

        found = checked(found)
        found.__module__ = public  # where pickle finds it
    return found


def _works(module: object, name: str) -> bool:
    """False for a name that cannot be imported without an extra; others raise when called."""
    try:
        getattr(module, name)
    except ImportError:
        return False
    return True


_get, _dir = _attach(__name__, __loader__, __file__)


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib.metadata import version

        return version("capsule-sym")
    found = _get(name)
    return ["__version__", *found] if name == "__all__" else found


def __dir__() -> list[str]:
    return ["__version__", *_dir()]
