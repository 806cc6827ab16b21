"""The exact three-dimensional map of a piecewise-linear capsule system with bidirectional drifts.

All public names are imported on first use, so importing the package costs almost nothing. They are
listed in `__init__.pyi`, which type checkers read as well.
"""

# Modules that cannot be imported without an extra; others raise when they are called.
_NEEDS = {
    "flint": ("_enclosures.certificates.certify", "_enclosures.certificates.checker"),
    "matplotlib": (
        *("_figures.attractors", "_figures.branches", "_figures.charts", "_figures.curves"),
        "_figures.design",
        *("_figures.diagrams", "_figures.evolution"),
        *("_figures.portraits", "_figures.pulses", "_figures.shocks"),
        *("_figures.style", "_figures.sweeps", "_figures.tolerances"),
    ),
    "zarr": ("_sweeps.basin", "_sweeps.execution", "_sweeps.results"),
}


# Not a cache of functools: its import would come before Ctrl-C has its handler in `__main__`.
_modules: dict[str, str] = {}


def _homes() -> dict[str, str]:
    """Module of each public name."""
    if not _modules:
        import re

        # The loader finds it in an archive too, and pathlib takes longer to import.
        stub = __loader__.get_data(f"{__file__.rpartition('.')[0]}.pyi").decode()
        found = re.findall(rf"from {__name__}\.(\S+) import \(?\s*(\w+) as", stub)
        _modules.update((name, module) for module, name in found)
    return _modules


def __getattr__(name: str) -> object:
    from importlib import import_module

    if name in (homes := _homes()):
        try:
            found: object = getattr(import_module(f"{__name__}.{homes[name]}"), name)
        except ModuleNotFoundError as missing:
            if str(missing.name).startswith(__name__):
                raise
            from capsule_sym._errors import NotInstalled

            raise NotInstalled(missing) from missing
        except ValueError as error:
            if not str(error).startswith("Key backend"):
                raise
            import os

            from capsule_sym._errors import InvalidInput

            backend = os.environ.get("MPLBACKEND")
            raise InvalidInput("MPLBACKEND", backend, "a backend of Matplotlib") from error
        if isinstance(found, type(_homes)):  # a function
            from capsule_sym._arguments import checked

            found = checked(found)
            found.__module__ = __name__  # where pickle finds it
    elif name == "scenes":
        found = import_module(f"{__name__}.scenes")
    elif name == "__version__":
        from importlib.metadata import version

        found = version("capsule-sym")
    elif name == "__all__":
        # Names available to `from capsule_sym import *`: one whose dependency is missing would make
        # the whole import fail.
        from importlib.util import find_spec

        absent = {one for need, some in _NEEDS.items() if find_spec(need) is None for one in some}
        found = [
            "__version__",
            "scenes",
            *sorted(n for n, module in homes.items() if module not in absent),
        ]
    else:
        from capsule_sym._errors import suggestion

        more = suggestion(name, homes) if name[0] != "_" else ""
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}{more}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return ["__version__", "scenes", *sorted(_homes())]
