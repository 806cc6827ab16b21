"""The figures by name: what each shows, and what is computed for it before it is drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
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
    from capsule_sym._figures import switching
    from capsule_sym._study.sections import sections

    parameters = study.schematic
    draw = {3: switching.plot_fig3, 4: switching.plot_fig4, 5: switching.plot_fig5}[which]
    bundles = [study.store.bundle(one, parameters) for one in sections(parameters)[which - 3]]
    return draw(bundles, parameters, **study.looks)


def _fig6(study: Study) -> Figure:
    from capsule_sym._figures.evolution import plot_fig6
    from capsule_sym._study.data import orbit_of

    record = study.branch()
    exact = [orbit_of(one) for one in record["bifurcations"]]
    return plot_fig6(study.motions(study.evenly(_BEHIND)), exact, **study.looks)


def _fig7(study: Study) -> Figure:
    from capsule_sym._figures.panels import plot_fig7
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
    from capsule_sym._figures.guards import plot_margins

    (plot_motion,) = study.motions([study.system.alpha if study.chosen else 1.5])
    return plot_margins(plot_motion, **study.looks, device=study.device)


def _energies(study: Study) -> Figure:
    from capsule_sym._figures.energy import plot_energies

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
    """A figure: its title and a caption, whether it depends on gamma, and how it is made."""

    title: str
    caption: str
    by_gamma: bool
    make: Callable[[Study], Figure]
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

    @property
    def alt(self) -> str:
        """What is seen, in words, for who does not see it."""
        from capsule_sym._figures.text_alternatives import ALTERNATIVES

        return ALTERNATIVES[next(name for name, one in FIGURES.items() if one.title == self.title)]


_EVENTS = (
    "Whole on the left, magnified around the line on the right; dotted below, solid at, dashed "
    "above the value."
)
FIGURES = {
    "fig1": Entry(
        "Fig. 1: the capsule",
        "A mass in a capsule that lies on the ground with dry friction. The drive moves the mass, "
        "the spring k_1 and the damper c hold it to the capsule, and beyond the gap G it meets the "
        "spring k_2.",
        False,
        _fig1,
        metric=True,
    ),
    "fig2": Entry(
        "Fig. 2: state space",
        "Subspaces, surfaces S1-S10 and lines L1-L9 at parameters that set them apart (ζ = 0.3, "
        "β = 0.6), and the plane P1 = 0 from above. L10 (δ > f_b) is not in Eq. (14).",
        False,
        _fig2,
    ),
    "fig3": Entry(
        "Fig. 3: switching on S1, S5 and S7",
        "Bundles of exact trajectories across a surface, with its normals and the fields.",
        False,
        lambda study: _bundles(study, 3),
    ),
    "fig4": Entry(
        "Fig. 4: switching on L1 to L4",
        "The stick fields F2 and F5 along the lines when the excitation is largest and least: on "
        "the middle parts of L2 and L3 they point to both sides. Then bundles of exact "
        "trajectories across each line, in a plane section.",
        False,
        lambda study: _bundles(study, 4),
    ),
    "fig5": Entry(
        "Fig. 5: switching on L5 to L8",
        "As Fig. 4, on the line where the planes P1 = 0 and P2 = δ meet.",
        False,
        lambda study: _bundles(study, 5),
    ),
    "fig6": Entry(
        "Fig. 6: phase trajectories over the excitation amplitude",
        "Steady motions in (x_r, v_r), one behind the other; wide lines are the orbits at the "
        "exact bifurcation values.",
        True,
        _fig6,
    ),
    "fig7": Entry(
        "Fig. 7: displacements and phase portraits, a to p",
        "At the printed amplitudes, with the fields of the steady motion in the order of time.",
        True,
        _fig7,
    ),
    "fig8": Entry(
        "Fig. 8: boundary-intersection crossings, printed amplitudes",
        _EVENTS,
        True,
        lambda study: _around(study, 8, exactly=False),
    ),
    "fig8-exact": Entry(
        "Fig. 8 around the exact values",
        f"{_EVENTS} The solid orbit is the one that Newton's method finds on the line.",
        True,
        lambda study: _around(study, 8, exactly=True),
    ),
    "fig9": Entry(
        "Fig. 9: sliding bifurcations, printed amplitudes",
        _EVENTS,
        True,
        lambda study: _around(study, 9, exactly=False),
    ),
    "fig9-exact": Entry(
        "Fig. 9 around the exact values",
        f"{_EVENTS} The solid orbit is the one that Newton's method finds on the line.",
        True,
        lambda study: _around(study, 9, exactly=True),
    ),
    "motion": Entry(
        "Displacements and phase portrait",
        "The steady motion from rest: mass dashed, capsule solid.",
        True,
        _motion,
        metric=True,
    ),
    "bifurcations": Entry(
        "Bifurcation diagram",
        "The branch of periodic orbits through the case study, with its exact bifurcations.",
        True,
        _bifurcations,
        metric=True,
    ),
    "itineraries": Entry(
        "Which field acts when",
        "One column is one period of the steady motion, from phase 0 upwards.",
        True,
        _itineraries,
        metric=True,
    ),
    "energies": Entry(
        "Where the work of a period goes",
        "What damper and friction take is stacked; it meets the work of the drive.",
        True,
        _energies,
        metric=True,
    ),
    "chart": Entry(
        "Motions over amplitude and mass ratio",
        "Each region is named by the fields of its motion in the order of time; curves are exact, "
        "circles the points where two bifurcations meet. Dashed: γ = 3.0 and 3.3.",
        False,
        _chart,
    ),
    "margins": Entry(
        "Guards of a motion over time",
        "At α = 1.5: the gap, the capsule's velocity and the force that it has to overcome; thin "
        "where the quantity is no guard of the acting field.",
        True,
        _margins,
        metric=True,
    ),
    "work-precision": Entry(
        "Work against precision",
        "A hollow marker: switches were missed or invented at that setting.",
        False,
        _work_precision,
    ),
}
"""Every figure by its name on the command line."""
