"""The figures by name: how each is made, its title, its caption and its text alternative."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from capsule_sym import InvalidInput, Parameters
from capsule_sym._parameters import of_paper
from capsule_sym.figures import plot_chart, plot_diagram, plot_motion
from paper.study import data
from paper.study.motions import BEGIN, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from capsule_sym._figures.arcs import Motion
    from paper.study.events import Event

_BEHIND = 40  # motions one behind the other in Fig. 6


def _schematic(study: Study) -> Parameters:
    """The system of Figs. 2 to 5: by default one whose lines lie apart."""
    from paper.study.sections import SCHEMATIC

    return of_paper(study.system) if study.chosen else SCHEMATIC


def _fig1(study: Study) -> Figure:
    from paper.figures.capsule import plot_fig1

    return plot_fig1(width=study.width)


def _fig2(study: Study) -> Figure:
    from paper.figures.statespace import plot_fig2

    return plot_fig2(_schematic(study), **study.looks)


def _switching(which: int) -> Callable[[Study], Figure]:
    def draw(study: Study) -> Figure:
        from paper.figures.switching import plot_switching
        from paper.study.sections import sections

        parameters = _schematic(study)
        bundles = [data.bundle(one, parameters) for one in sections(parameters)[which - 3]]
        return plot_switching(which, bundles, parameters, **study.looks)

    return draw


def _fig6(study: Study) -> Figure:
    from paper.figures.motions import plot_fig6

    exact = [one.orbit for one in study.branch().bifurcations]
    return plot_fig6(study.motions(study.evenly(_BEHIND)), exact, **study.looks)


def _fig7(study: Study) -> Figure:
    from paper.figures.motions import plot_fig7
    from paper.study.casestudy import PANELS

    return plot_fig7(study.motions(list(PANELS.values())), **study.looks)


def _around(which: int, exactly: bool) -> Callable[[Study], Figure]:
    """Fig. 8 or 9, around the printed values or the exact ones."""

    def draw(study: Study) -> Figure:
        from paper.figures.events import plot_events
        from paper.study.events import CROSSINGS, SLIDINGS, exact

        events: Sequence[Event] = {8: CROSSINGS, 9: SLIDINGS}[which]
        if not exactly:
            return plot_events(
                events, [study.motions(list(one.alphas)) for one in events], **study.looks
            )
        found = exact(events, study.branch().bifurcations)
        orbits: list[list[Motion]] = [
            [
                one.orbit if one and alpha == event.middle else study.motions([alpha])[0]
                for alpha in event.alphas
            ]
            for event, one in found
        ]
        return plot_events([event for event, _ in found], orbits, **study.looks)

    return draw


def _chart(study: Study) -> Figure:
    from paper.study.casestudy import GAMMAS

    curves = data.plane_curves(study.track, study.at(BEGIN))
    return plot_chart(data.plane_cells(study.system), curves, levels=GAMMAS, width=study.width)


def _motion(study: Study) -> Figure:
    (found,) = study.motions([study.system.alpha])
    return plot_motion(found, **study.looks, device=study.device)


def _bifurcations(study: Study) -> Figure:
    return plot_diagram(study.branch(), **study.looks, device=study.device)


@dataclass(frozen=True)
class Entry:
    """A figure: how it is made, and its texts."""

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
            from capsule_sym._figures.interface import DIMENSIONLESS, add_words
            from capsule_sym.figures import figure_style

            with figure_style():
                # On the side that has no key yet.
                middle = figure.bbox.height / 2
                free = all(key.get_window_extent().y0 > middle for key in figure.legends)
                add_words(figure, [DIMENSIONLESS], below=free)
        return figure


FIGURES = {
    "fig1": Entry(
        _fig1,
        title="Fig. 1: the capsule",
        caption=(
            "A mass in a capsule that lies on the ground with dry friction. The drive moves the "
            "mass, the spring k_1 and the damper c hold it to the capsule, and beyond the gap G "
            "it meets the spring k_2."
        ),
        seen=(
            "A capsule lies on hatched ground. In it a mass M_m is tied to the left wall by a "
            "spring k_1 above a damper c. Right of the mass, at a gap G, a plate stands before a "
            "spring k_2 on the right wall. Arrows: displacements X_m and X_c and the drive P_d "
            "cos Omega t to the right, friction F_r to the left."
        ),
        metric=True,
    ),
    "fig2": Entry(
        _fig2,
        title="Fig. 2: state space",
        caption=(
            "Subspaces, surfaces S1-S10 and lines L1-L9 at parameters that set them apart (ζ = "
            "0.3, β = 0.6), and the plane P1 = 0 from above. L10 (δ > f_b) is not in Eq. (14)."
        ),
        seen=(
            "Above, in perspective: the horizontal plane v_c = 0 cut by the upright plane x_r = "
            "delta, with six tinted surfaces S1 to S6 on the one and four, S7 to S10, on the "
            "other, the lines L1 to L8 between them and L9 upright. Below, the plane v_c = 0 from "
            "above for gaps less than, equal to and larger than the friction bound: two pairs of "
            "parallel oblique lines that meet the upright line in the points O1 and O2."
        ),
    ),
    "fig3": Entry(
        _switching(3),
        title="Fig. 3: switching on S1, S5 and S7",
        caption="Bundles of exact trajectories across a surface, with its normals and the fields.",
        seen=(
            "Three square sections with bundles of trajectories. On S1 those of F3 come from "
            "below and continue as F1; on S5 those of F4 and F6 come from both sides and continue "
            "along it as F5; across S7 those of F1 continue as F4. Arrows show both normals and "
            "the fields."
        ),
    ),
    "fig4": Entry(
        _switching(4),
        title="Fig. 4: switching on L1 to L4",
        caption=(
            "The stick fields F2 and F5 along the lines when the excitation is largest and least: "
            "on the middle parts of L2 and L3 they point to both sides. Then bundles of exact "
            "trajectories across each line, in a plane section."
        ),
        seen=(
            "Left, the plane v_c = 0 with arrows of the stick fields along L1 to L4, black and "
            "grey for the two ends of the excitation. Right, six sections with bundles of "
            "trajectories across L1, two parts of L2, two parts of L3, and L4: beside each a "
            "stretch of stick begins or ends."
        ),
    ),
    "fig5": Entry(
        _switching(5),
        title="Fig. 5: switching on L5 to L8",
        caption="As Fig. 4, on the line where the planes P1 = 0 and P2 = δ meet.",
        seen=(
            "Left, the plane v_c = 0 with arrows across the upright line x_r = delta. Right, four "
            "sections with bundles of trajectories across L5 to L8: stick lies beside L6 and L7, "
            "none beside L5 and L8."
        ),
    ),
    "fig6": Entry(
        _fig6,
        title="Fig. 6: phase trajectories over the excitation amplitude",
        caption=(
            "Steady motions in (x_r, v_r), one behind the other; wide lines are the orbits at the "
            "exact bifurcation values."
        ),
        seen=(
            "Closed orbits in the plane of relative displacement and velocity, one behind the "
            "other by excitation amplitude from 0 to 2: small ovals of stick that grow, and gain "
            "forward drift, then backward drift and a loop. The orbits at the exact bifurcation "
            "values are drawn wide."
        ),
        by_gamma=True,
    ),
    "fig7": Entry(
        _fig7,
        title="Fig. 7: displacements and phase portraits, a to p",
        caption=(
            "At the printed amplitudes, with the fields of the steady motion in the order of time."
        ),
        seen=(
            "Sixteen pairs of small diagrams, a to p, of growing amplitude. Left of each pair the "
            "displacements of mass and capsule over three periods: at rest on average at first, "
            "then in steps forward. Right the closed orbit with the switching lines, and its "
            "itinerary from F5 F2 to F4 F1 F3 F6."
        ),
        by_gamma=True,
    ),
    "fig8": Entry(
        _around(8, exactly=False),
        title="Fig. 8: boundary-intersection crossings, printed amplitudes",
        caption=(
            "Whole on the left, magnified around the line on the right; dotted below, solid at, "
            "dashed above the value."
        ),
        seen=(
            "Two rows: the orbits below, at and above a boundary-intersection crossing in the "
            "state space, whole on the left and magnified on the right, where the middle one "
            "passes through the line."
        ),
        by_gamma=True,
    ),
    "fig8-exact": Entry(
        _around(8, exactly=True),
        title="Fig. 8 around the exact values",
        caption=(
            "Whole on the left, magnified around the line on the right; dotted below, solid at, "
            "dashed above the value. The solid orbit is the one that Newton's method finds on the "
            "line."
        ),
        seen=(
            "Two rows: the orbits below, at and above a boundary-intersection crossing in the "
            "state space, whole on the left and magnified on the right, where the middle one "
            "passes through the line."
        ),
        by_gamma=True,
    ),
    "fig9": Entry(
        _around(9, exactly=False),
        title="Fig. 9: sliding bifurcations, printed amplitudes",
        caption=(
            "Whole on the left, magnified around the line on the right; dotted below, solid at, "
            "dashed above the value."
        ),
        seen=(
            "Four rows for adding-, crossing-, switching- and grazing-sliding: orbits below, at "
            "and above the value in the state space, whole on the left and magnified on the "
            "right, where the middle one touches or passes the line."
        ),
        by_gamma=True,
    ),
    "fig9-exact": Entry(
        _around(9, exactly=True),
        title="Fig. 9 around the exact values",
        caption=(
            "Whole on the left, magnified around the line on the right; dotted below, solid at, "
            "dashed above the value. The solid orbit is the one that Newton's method finds on the "
            "line."
        ),
        seen=(
            "Four rows for adding-, crossing-, switching- and grazing-sliding: orbits below, at "
            "and above the value in the state space, whole on the left and magnified on the "
            "right, where the middle one touches or passes the line."
        ),
        by_gamma=True,
    ),
    "motion": Entry(
        _motion,
        title="Displacements and phase portrait",
        caption="The steady motion from rest: mass dashed, capsule solid.",
        seen=(
            "Left, displacements of mass and capsule over three periods, the capsule in steps. "
            "Right, the closed orbit in the phase plane with the switching lines. Colours are "
            "those of the fields."
        ),
        by_gamma=True,
        metric=True,
        general=True,
    ),
    "bifurcations": Entry(
        _bifurcations,
        title="Bifurcation diagram",
        caption=(
            "The branch of periodic orbits through the case study, with its exact bifurcations."
        ),
        seen=(
            "The stroboscopic relative displacement over the excitation amplitude from 0 to 2, a "
            "solid curve. Eight circles on it mark the bifurcations, with their labels and a key."
        ),
        by_gamma=True,
        metric=True,
        general=True,
    ),
    "chart": Entry(
        _chart,
        title="Motions over amplitude and mass ratio",
        caption=(
            "The key gives the itinerary of each number, the fields in the order of time; curves "
            "are exact, circles the points where two bifurcations meet. Dashed: γ = 3.0 and 3.3."
        ),
        seen=(
            "A plane of amplitude and mass ratio, cut by eight curves into numbered regions with "
            "an itinerary each. The first four curves are nearly upright; beyond an amplitude of "
            "1.2 the curves bend and cross in circles."
        ),
    ),
}
"""Every figure by its name on the command line."""
