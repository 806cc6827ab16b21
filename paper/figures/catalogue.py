"""The figures by name: what each shows, and what is computed for it before it is drawn."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import capsule_sym
from capsule_sym import InvalidInput
from capsule_sym._figures.sizes import PAGE
from capsule_sym._files import read_json
from capsule_sym._parameters import of_paper

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from capsule_sym import Parameters, SceneDevice, SceneParameters, Trajectory
    from capsule_sym._figures.arcs import Motion
    from capsule_sym._figures.data import Store
    from capsule_sym._figures.style import Colours

BENCH = Path("results/bench/bench.json")
_PART = BENCH.with_name("part.json")  # of a quick study, or one with some of the tools
_BEGIN, _END = 0.005, 2.0  # excitation amplitudes of the case study
_SAMPLES = 400  # motions side by side in the picture of itineraries
_BEHIND = 40  # motions one behind the other in Fig. 6


@dataclass(frozen=True)
class Study:
    """Input of a figure: results kept in a store, of one system.

    `chosen` is true for a system of the user; otherwise Figs. 2 to 5 show one whose lines lie
    apart, and the guards are those at a larger amplitude. `width` is in inches. Of a `device`
    the figures are in SI units, or say that they are not.
    """

    store: Store
    system: SceneParameters
    colours: Colours = "safe"
    width: float = PAGE
    chosen: bool = False
    device: SceneDevice | None = None

    @property
    def looks(self) -> dict[str, Any]:
        """Options of every figure with segments."""
        return {"colours": self.colours, "width": self.width}

    @property
    def schematic(self) -> Parameters:
        """The system of Figs. 2 to 5."""
        from paper.study.sections import SCHEMATIC

        return of_paper(self.system) if self.chosen else SCHEMATIC

    def at(self, alpha: float) -> SceneParameters:
        """The system at an excitation amplitude."""
        return self.system.replace(alpha=alpha)

    def motions(self, alphas: list[float]) -> list[Trajectory]:
        """The steady motions from rest at excitation amplitudes."""
        return self.store.motions([self.at(alpha) for alpha in alphas])

    @property
    def last(self) -> float:
        """The largest excitation amplitude: that of the case study, or the system's own."""
        return max(_END, self.system.alpha)

    def branch(self) -> Any:
        """The branch in alpha over the whole case study, and further to the system's own."""
        return self.store.branch(self.at(_BEGIN), "alpha", _BEGIN, self.last)

    def evenly(self, count: int) -> list[float]:
        """Excitation amplitudes from the first to the last, evenly spaced."""
        return [_BEGIN + (self.last - _BEGIN) * i / (count - 1) for i in range(count)]


def _switching(study: Study, which: int) -> Figure:
    from paper.study.sections import sections

    parameters = study.schematic
    bundles = [study.store.bundle(one, parameters) for one in sections(parameters)[which - 3]]
    return capsule_sym.plot_switching(which, bundles, parameters, **study.looks)


def _fig6(study: Study) -> Figure:
    exact = [capsule_sym.orbit_from_record(one["orbit"]) for one in study.branch()["bifurcations"]]
    return capsule_sym.plot_fig6(study.motions(study.evenly(_BEHIND)), exact, **study.looks)


def _fig7(study: Study) -> Figure:
    from paper.study.casestudy import PANELS

    return capsule_sym.plot_fig7(study.motions(list(PANELS.values())), **study.looks)


def _around(study: Study, which: int, exactly: bool) -> Figure:
    from capsule_sym._figures.data import orbit_of
    from paper.study.events import CROSSINGS, SLIDINGS, exact

    events = {8: CROSSINGS, 9: SLIDINGS}[which]
    if not exactly:
        groups = [study.motions(list(event.alphas)) for event in events]
        return capsule_sym.plot_events(events, groups, **study.looks)
    record = study.branch()
    found = exact(events, record["bifurcations"])
    orbits: list[list[Motion]] = [
        [
            orbit_of(one) if one and alpha == event.middle else study.motions([alpha])[0]
            for alpha in event.alphas
        ]
        for event, one in found
    ]
    return capsule_sym.plot_events([event for event, _ in found], orbits, **study.looks)


def _itineraries(study: Study) -> Figure:
    motions = study.motions(study.evenly(_SAMPLES))
    return capsule_sym.plot_itineraries(motions, study.branch(), **study.looks, device=study.device)


def _of_branch(study: Study, draw: Callable[..., Figure]) -> Figure:
    return draw(study.branch(), width=study.width, device=study.device)


def _of_motion(study: Study, draw: Callable[..., Figure], alpha: float) -> Figure:
    (found,) = study.motions([alpha])
    return draw(found, **study.looks, device=study.device)


def _chart(study: Study) -> Figure:
    from capsule_sym._figures.charts import draw_regions
    from capsule_sym._figures.regions import PLANE
    from paper.study.casestudy import GAMMAS

    start = study.at(_BEGIN)
    curves = study.store.curves(start, PLANE)
    regions = study.store.regions(start, PLANE)
    return draw_regions(PLANE, regions, curves, levels=GAMMAS, width=study.width)


def measured() -> Path:
    """The file with the times of all tools or, where there is none, that of a part of the study."""
    return _PART if _PART.exists() and not BENCH.exists() else BENCH


def _work_precision(study: Study) -> Figure:
    path = measured()
    if not path.exists():
        made = "there; make it with: capsule-sym bench --out results/bench"
        raise InvalidInput("results", str(path), made)
    record = read_json(path, "JSON", "results")
    return capsule_sym.plot_work_precision(record, width=study.width)


@dataclass(frozen=True)
class Entry:
    """A figure: how it is made, and its record in figures.toml."""

    make: Callable[[Study], Figure]
    title: str
    caption: str
    seen: str
    """Text alternative of the figure."""
    by_gamma: bool = False
    """True if it depends on gamma."""
    metric: bool = False
    """True if it is drawn in a device's units."""
    general: bool = False
    """True if it can be drawn for any scene, not only for the paper's."""

    def drawn(self, study: Study) -> Figure:
        """The figure, with a word where a device's is dimensionless.

        Raises InvalidInput for another scene than the paper's where it is of that alone.
        """
        if study.system.scene.entry and not self.general:
            names = ", ".join(name for name, entry in FIGURES.items() if entry.general)
            allowed = f"capsule, for a figure of the paper; of any scene are {names}"
            raise InvalidInput("scene", study.system.scene.name, allowed)
        figure = self.make(study)
        if study.device is not None and not self.metric:
            from capsule_sym import figure_style
            from capsule_sym._figures.layout import add_words
            from capsule_sym._figures.units import DIMENSIONLESS

            with figure_style():
                # On the side that has no key yet.
                middle = figure.bbox.height / 2
                free = all(key.get_window_extent().y0 > middle for key in figure.legends)
                add_words(figure, [DIMENSIONLESS], below=free)
        return figure


_MADE: dict[str, Callable[[Study], Figure]] = {
    "fig1": lambda study: capsule_sym.plot_fig1(width=study.width),
    "fig2": lambda study: capsule_sym.plot_fig2(study.schematic, **study.looks),
    "fig3": lambda study: _switching(study, 3),
    "fig4": lambda study: _switching(study, 4),
    "fig5": lambda study: _switching(study, 5),
    "fig6": _fig6,
    "fig7": _fig7,
    "fig8": lambda study: _around(study, 8, exactly=False),
    "fig8-exact": lambda study: _around(study, 8, exactly=True),
    "fig9": lambda study: _around(study, 9, exactly=False),
    "fig9-exact": lambda study: _around(study, 9, exactly=True),
    "motion": lambda study: _of_motion(study, capsule_sym.plot_motion, study.system.alpha),
    "bifurcations": lambda study: _of_branch(study, capsule_sym.plot_bifurcations),
    "itineraries": _itineraries,
    "energies": lambda study: _of_branch(study, capsule_sym.plot_energies),
    "chart": _chart,
    "margins": lambda study: _of_motion(
        study, capsule_sym.plot_margins, study.system.alpha if study.chosen else 1.5
    ),
    "work-precision": _work_precision,
}
_RECORDS = tomllib.loads((files(__package__) / "figures.toml").read_text(encoding="utf-8"))
for _figure in ("fig8", "fig9"):
    _like = _RECORDS[_figure]
    _more = "The solid orbit is the one that Newton's method finds on the line."
    _RECORDS[f"{_figure}-exact"] = _like | {
        "title": f"Fig. {_figure[3:]} around the exact values",
        "caption": f"{_like['caption']} {_more}",
    }
_GENERAL = {"motion", "bifurcations", "itineraries", "energies", "margins"}
FIGURES = {
    name: Entry(make, **_RECORDS[name], general=name in _GENERAL) for name, make in _MADE.items()
}
"""Every figure by its name on the command line."""
