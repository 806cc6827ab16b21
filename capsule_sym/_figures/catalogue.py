"""The figures by name: what each shows, and what is computed for it before it is drawn."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from capsule_sym._errors import InvalidInput
from capsule_sym._figures.sizes import PAGE
from capsule_sym._files import read_json

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from capsule_sym._figures.style import Colours
    from capsule_sym._map import Trajectory
    from capsule_sym._parameters import Parameters, PhysicalParameters
    from capsule_sym._study.arcs import Motion
    from capsule_sym._study.data import Store

BENCH = Path("results/bench/bench.json")
_PART = BENCH.with_name("part.json")  # of a quick study, or one with some of the tools
_BEGIN, _END = 0.005, 2.0  # excitation amplitudes of the case study
_SAMPLES = 400  # motions side by side in the picture of itineraries
_BEHIND = 40  # motions one behind the other in Fig. 6


@dataclass(frozen=True)
class Study:
    """What a figure is made from: results kept in a store, of one system.

    `chosen` says that the system is the user's: else Figs. 2 to 5 show one whose lines lie apart,
    and the guards are those at a larger amplitude. `width` is in inches. Of a `device` the figures
    are in SI units, or say that they are not.
    """

    store: Store
    system: Parameters
    colours: Colours = "safe"
    width: float = PAGE
    chosen: bool = False
    device: PhysicalParameters | None = None

    @property
    def looks(self) -> dict[str, Any]:
        """Options of every figure with segments."""
        return {"colours": self.colours, "width": self.width}

    @property
    def schematic(self) -> Parameters:
        """The system of Figs. 2 to 5."""
        from capsule_sym._study.sections import SCHEMATIC

        return self.system if self.chosen else SCHEMATIC

    def at(self, alpha: float) -> Parameters:
        """The system at an excitation amplitude."""
        return self.system.replace(alpha=alpha)

    def motions(self, alphas: list[float]) -> list[Trajectory]:
        """The steady motions from rest at excitation amplitudes."""
        return self.store.motions([self.at(alpha) for alpha in alphas])

    def branch(self) -> Any:
        """The branch in alpha over the whole case study."""
        return self.store.branch(self.at(_BEGIN), "alpha", _BEGIN, _END)

    def evenly(self, count: int) -> list[float]:
        """Excitation amplitudes from the first to the last, evenly spaced."""
        return [_BEGIN + (_END - _BEGIN) * i / (count - 1) for i in range(count)]


def _fig1(study: Study) -> Figure:
    from capsule_sym._figures.device import plot_fig1

    return plot_fig1(width=study.width)


def _fig2(study: Study) -> Figure:
    from capsule_sym._figures.statespace import plot_fig2

    return plot_fig2(study.schematic, **study.looks)


def _bundles(study: Study, which: int) -> Figure:
    from capsule_sym._figures.switching import plot_switching
    from capsule_sym._study.sections import sections

    parameters = study.schematic
    bundles = [study.store.bundle(one, parameters) for one in sections(parameters)[which - 3]]
    return plot_switching(which, bundles, parameters, **study.looks)


def _fig6(study: Study) -> Figure:
    from capsule_sym._figures.evolution import plot_fig6
    from capsule_sym._study.data import orbit_of

    record = study.branch()
    exact = [orbit_of(one) for one in record["bifurcations"]]
    return plot_fig6(study.motions(study.evenly(_BEHIND)), exact, **study.looks)


def _fig7(study: Study) -> Figure:
    from capsule_sym._figures.portraits import plot_fig7
    from capsule_sym._study.casestudy import PANELS

    return plot_fig7(study.motions(list(PANELS.values())), **study.looks)


def _around(study: Study, which: int, exactly: bool) -> Figure:
    from capsule_sym._figures.events import plot_events
    from capsule_sym._study.data import orbit_of
    from capsule_sym._study.events import CROSSINGS, SLIDINGS, exact

    events = {8: CROSSINGS, 9: SLIDINGS}[which]
    if not exactly:
        groups = [study.motions(list(event.alphas)) for event in events]
        return plot_events(events, groups, **study.looks)
    record = study.branch()
    found = exact(events, record["bifurcations"])
    orbits: list[list[Motion]] = [
        [
            orbit_of(one) if one and alpha == event.middle else study.motions([alpha])[0]
            for alpha in event.alphas
        ]
        for event, one in found
    ]
    return plot_events([event for event, _ in found], orbits, **study.looks)


def _bifurcations(study: Study) -> Figure:
    from capsule_sym._figures.branches import plot_bifurcations

    return plot_bifurcations(study.branch(), width=study.width, device=study.device)


def _itineraries(study: Study) -> Figure:
    from capsule_sym._figures.evolution import plot_itineraries

    motions = study.motions(study.evenly(_SAMPLES))
    return plot_itineraries(motions, study.branch(), **study.looks, device=study.device)


def _motion(study: Study) -> Figure:
    from capsule_sym._figures.portraits import plot_motion

    (found,) = study.store.motions([study.system])
    return plot_motion(found, **study.looks, device=study.device)


def _margins(study: Study) -> Figure:
    from capsule_sym._figures.portraits import plot_margins

    (plot_motion,) = study.motions([study.system.alpha if study.chosen else 1.5])
    return plot_margins(plot_motion, **study.looks, device=study.device)


def _energies(study: Study) -> Figure:
    from capsule_sym._figures.branches import plot_energies

    return plot_energies(study.branch(), width=study.width, device=study.device)


def _chart(study: Study) -> Figure:
    from capsule_sym._figures.charts import draw_regions
    from capsule_sym._study.casestudy import GAMMAS
    from capsule_sym._study.regions import PLANE

    start = study.at(_BEGIN)
    curves = study.store.curves(start, PLANE)
    regions = study.store.regions(start, PLANE)
    return draw_regions(PLANE, regions, curves, levels=GAMMAS, width=study.width)


def measured() -> Path:
    """The file with the times of all tools or, where there is none, that of a part of the study."""
    return _PART if _PART.exists() and not BENCH.exists() else BENCH


def _work_precision(study: Study) -> Figure:
    from capsule_sym._figures.precision import plot_work_precision

    path = measured()
    if not path.exists():
        made = "there; make it with: capsule-sym bench --out results/bench"
        raise InvalidInput("results", str(path), made)
    return plot_work_precision(read_json(path, "JSON", "results"), width=study.width)


@dataclass(frozen=True)
class Entry:
    """A figure: how it is made, and its record in figures.toml."""

    make: Callable[[Study], Figure]
    title: str
    caption: str
    seen: str
    """Text alternative: what is seen, in words."""
    by_gamma: bool = False
    """Whether it depends on gamma."""
    metric: bool = False
    """Whether it is drawn in a device's units."""

    def drawn(self, study: Study) -> Figure:
        """The figure, with a word where a device's is dimensionless."""
        figure = self.make(study)
        if study.device is not None and not self.metric:
            from capsule_sym._figures.layout import add_words
            from capsule_sym._figures.style import figure_style
            from capsule_sym._figures.units import DIMENSIONLESS

            with figure_style():
                # On the side that has no key yet.
                middle = figure.bbox.height / 2
                free = all(key.get_window_extent().y0 > middle for key in figure.legends)
                add_words(figure, [DIMENSIONLESS], below=free)
        return figure


_MADE: dict[str, Callable[[Study], Figure]] = {
    "fig1": _fig1,
    "fig2": _fig2,
    "fig3": partial(_bundles, which=3),
    "fig4": partial(_bundles, which=4),
    "fig5": partial(_bundles, which=5),
    "fig6": _fig6,
    "fig7": _fig7,
    "fig8": partial(_around, which=8, exactly=False),
    "fig8-exact": partial(_around, which=8, exactly=True),
    "fig9": partial(_around, which=9, exactly=False),
    "fig9-exact": partial(_around, which=9, exactly=True),
    "motion": _motion,
    "bifurcations": _bifurcations,
    "itineraries": _itineraries,
    "energies": _energies,
    "chart": _chart,
    "margins": _margins,
    "work-precision": _work_precision,
}
_RECORDS = tomllib.loads((files(__package__) / "figures.toml").read_text(encoding="utf-8"))
FIGURES = {name: Entry(make, **_RECORDS[name]) for name, make in _MADE.items()}
"""Every figure by its name on the command line."""
