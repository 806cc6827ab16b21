"""The scenes: `scenes.slope` and others that ship, `scenes.load(folder)` for one's own.

A scene has the classes of its parameters: `scenes.slope.Parameters(alpha=0.7, s=0.05)`.
"""

from __future__ import annotations

from capsule_sym._errors import suggestion
from capsule_sym._parameters import SHIPPED, Scene, load

__all__ = ["SHIPPED", "Scene", "load"]


def __getattr__(name: str) -> Scene:
    if name not in SHIPPED:
        more = suggestion(name, SHIPPED)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}{more}")
    return load(name)


def __dir__() -> list[str]:
    return [*__all__, *SHIPPED]
