"""The figures by name, of any system: what is computed for each before it is drawn."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import capsule_sym
from capsule_sym._figures.sizes import PAGE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from capsule_sym._figures.style import Colours
    from capsule_sym._map import Trajectory
    from capsule_sym._parameters import SceneDevice, SceneParameters

BEGIN, END = 0.005, 2.0
"""Excitation amplitudes between which figures over alpha are drawn."""
_SAMPLES = 400  # motions side by side in the picture of itineraries

Track = Callable[[Iterable[Any], str | Callable[[Any], str], float | None], Iterable[Any]]
"""Passes items on and shows how many of a total are done (None if unknown). The text describes the
work, or is a function that describes each item."""


@dataclass(frozen=True)
class Study:
    """Input of a figure: one system, whose motions and branch are computed with progress.

    `chosen` is true for a system of the user; otherwise the guards are those at a larger
    amplitude. `width` is in inches. Of a `device` the figures are in SI units.
    """

    track: Track
    system: SceneParameters
    colours: Colours = "safe"
    width: float = PAGE
    chosen: bool = False
    device: SceneDevice | None = None

    @property
    def looks(self) -> dict[str, Any]:
        """Options of every figure with segments."""
        return {"colours": self.colours, "width": self.width}

    def at(self, alpha: float) -> SceneParameters:
        """The system at an excitation amplitude."""
        return self.system.replace(alpha=alpha)

    def motions(self, alphas: list[float]) -> list[Trajectory]:
        """The steady motions from rest at excitation amplitudes."""
        from capsule_sym._figures.computed import steady_run

        tracked = self.track(map(self.at, alphas), "Settling motions", len(alphas))
        return [steady_run(parameters) for parameters in tracked]

    @property
    def last(self) -> float:
        """The largest excitation amplitude: 2, or the system's own if it is larger."""
        return max(END, self.system.alpha)

    def branch(self) -> Any:
        """The branch in alpha from 0.005 to the largest amplitude."""
        from capsule_sym._figures.computed import branch_from_rest

        # One step, which begins when its progress is shown.
        ends = (BEGIN, self.last)
        step = (branch_from_rest(self.at(BEGIN), "alpha", ends) for _ in range(1))
        (branch,) = self.track(step, "Following the branch", None)
        return branch

    def evenly(self, count: int) -> list[float]:
        """Excitation amplitudes from the first to the last, evenly spaced."""
        return [BEGIN + (self.last - BEGIN) * i / (count - 1) for i in range(count)]


def _motion(study: Study) -> Figure:
    motions = study.motions([study.system.alpha])
    return capsule_sym.figures.plot_motion(*motions, **study.looks, device=study.device)


def _margins(study: Study) -> Figure:
    (found,) = study.motions([study.system.alpha if study.chosen else 1.5])
    return capsule_sym.figures.plot_margins(found, **study.looks, device=study.device)


def _bifurcations(study: Study) -> Figure:
    return capsule_sym.figures.plot_bifurcations(
        study.branch(), width=study.width, device=study.device
    )


def _energies(study: Study) -> Figure:
    return capsule_sym.figures.plot_energies(study.branch(), width=study.width, device=study.device)


def _itineraries(study: Study) -> Figure:
    motions, looks = study.motions(study.evenly(_SAMPLES)), study.looks
    return capsule_sym.figures.plot_itineraries(
        motions, study.branch(), **looks, device=study.device
    )


class Entry(NamedTuple):
    """A figure: its title, and how it is made."""

    title: str
    make: Callable[[Study], Figure]


FIGURES = {
    "motion": Entry("Displacements and phase portrait", _motion),
    "bifurcations": Entry("Bifurcation diagram", _bifurcations),
    "itineraries": Entry("Which field acts when", _itineraries),
    "energies": Entry("Where the work of a period goes", _energies),
    "margins": Entry("Guards of a motion over time", _margins),
}
"""Every figure by its name on the command line."""
