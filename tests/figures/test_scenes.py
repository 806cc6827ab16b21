"""Pictures of scenes other than the paper's: stops, borders of rest, pulses, colours and labels."""

import numpy as np
import pytest

from capsule_sym import InvalidInput, scenes, simulate
from capsule_sym._figures.arcs import arcs
from capsule_sym._figures.design import metric_label
from capsule_sym._figures.portraits import PULSE, borders, labels_of, stops_of
from capsule_sym._figures.style import field_colour
from capsule_sym._figures.units import Units, named
from capsule_sym._records import in_si
from capsule_sym.figures import plot_motion

DEVICE = {
    **{"M_m": 1.8e-3, "M_c": 1.7e-3, "k1": 62, "k_front": 54e3, "k_back": 28e3, "c": 0.016},
    **{"G_front": 1.6e-3, "G_back": 4e-4, "P_d": 0.016, "P_low": 0, "duty": 0.4, "Omega": 130},
    **{"mu": 0.23, "mu_back": 0.23},
}
SLOPE, PULSED = scenes.slope, scenes.reaction_pulse


@pytest.mark.parametrize("name", scenes.SHIPPED)
def test_every_field_has_a_colour_of_its_own(name: str) -> None:
    scene = scenes.load(name)
    colours = [field_colour(field, scene=scene) for field in scene.facts.FIELDS]
    assert len({*colours}) == len(colours) == len(scene.facts.MODES)


def test_a_portrait_shows_the_stop_and_where_rest_ends() -> None:
    p = SLOPE.Parameters(alpha=0.8, s=-0.05)
    found = dict.fromkeys(name for name, _ in borders(p, -1.0, 1.0))
    assert found.keys() == {"stop", "rest ends forward", "rest ends backward"}
    for name, line in borders(p, -1.0, 1.0):
        for x_r, v_r in line.tolist():
            force = x_r + 2 * p.zeta * v_r + p.beta * max(x_r - p.delta, 0.0)
            level = {"rest ends forward": p.f_plus, "rest ends backward": -p.f_minus}
            assert name == "stop" or force == pytest.approx(level[name], abs=1e-12)
    figure = plot_motion(simulate(p, periods=40))
    assert {*found} - {"rest ends backward"} <= labels_of(figure)
    assert stops_of(p) == (p.delta,)


def test_pulses_are_shown() -> None:
    p = PULSED.Parameters(alpha=1.8, delta=0.1, D=0.3)
    figure = plot_motion(simulate(p, periods=60))
    left, _ = figure.axes
    bands = [patch.get_extents() for patch in left.patches if patch.get_label() == PULSE]
    ends = [left.transData.inverted().transform(band)[:, 0].tolist() for band in bands]
    assert ends == [pytest.approx([turn, turn + 0.3]) for turn in range(3)]
    assert not [name for name, _ in borders(p, -1.0, 1.0) if name != "stop"]  # they move


def test_labels_and_units_are_those_of_the_scene() -> None:
    assert named("s") == "bias on the mass $s$"
    assert named("f_plus") == "friction bound forward $f_+$"
    assert Units(None, SLOPE).label("f_minus") == "friction bound backward $f_-$"
    assert metric_label("f_minus", SLOPE.Parameters()) == "friction bound backward $f_-$"
    device = scenes.capsule.PhysicalParameters(
        M_m=0.5, M_c=1.65, k1=50, k2=75, c=0.5, G=0.0017, P_d=3, Omega=8, mu=0.2
    )
    with pytest.raises(InvalidInput, match="must be of the scene slope"):
        Units.of_motion(device, SLOPE.Parameters())


def test_a_stiff_contact_is_drawn_as_a_curve() -> None:
    """The mass turns at the stop in 1/30 of a period: no step of its velocity is a large part."""
    run = simulate(scenes.prototype.Parameters(alpha=2.4, delta_1=1.5), periods=60)
    touched = [arc for arc in arcs(run, 1) if arc.scene.facts.FIELDS[arc.field][0]]
    assert touched
    for arc in touched:
        assert np.ptp(arc.time) < 1 / 30
        assert np.max(abs(np.diff(arc.v_r))) < 0.1 * np.ptp(arc.v_r)


def test_the_legend_has_what_is_drawn_alone() -> None:
    figure = plot_motion(simulate(scenes.prototype.Parameters(alpha=2.0), periods=60))
    texts = {text.get_text() for key in figure.legends for text in key.get_texts()}
    assert "rest ends forward" in texts
    assert "stop" not in texts  # it is beyond the view
    device = Units(scenes.prototype.PhysicalParameters(**DEVICE), scenes.prototype)
    row = in_si(device.device, {"D": 0.4})
    assert row == {"duty": pytest.approx(0.4)}
