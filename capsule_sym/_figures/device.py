"""The capsule, its mass and its springs as a drawing, in an animation."""

from __future__ import annotations

import math
from pathlib import Path
from subprocess import CalledProcessError
from typing import Any, NamedTuple

import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter
from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch, Rectangle
from matplotlib.transforms import Affine2D

from capsule_sym._errors import InvalidInput
from capsule_sym._figures.arcs import Motion, arcs, cycle
from capsule_sym._figures.layout import add_key
from capsule_sym._figures.notebook import StyledFigure
from capsule_sym._figures.portraits import field_handles, plot_phase_portrait, stops_of
from capsule_sym._figures.sizes import MOVING
from capsule_sym._figures.style import Colours, check_resolution, field_colour, figure_style
from capsule_sym._figures.units import Units
from capsule_sym._files import whole
from capsule_sym._parameters import SceneDevice, SceneParameters

INK, _SHELL, _MASS, SOFT = "#16202c", "#eef1f5", "#56B4E9", "#52606f"
_HALF, _HIGH, _ROUND = 2.6, 1.1, 0.55  # half length, height and rounding of the shell
_WIDE = 0.42  # half width of the mass
_WALL = 0.14
_STOP = 0.16  # thickness of the plate on the second spring


class Frame(NamedTuple):
    """Places of the capsule and the mass in a drawing, and their contacts.

    `capsule` and `mass` are displacements in the drawing's units, `gap` that between the mass at
    rest and the second spring, `behind` that to one behind it, if there is one.
    """

    capsule: float = 0.0
    mass: float = 0.0
    gap: float = 0.45
    behind: float | None = None


def draw_capsule(axes: Axes, frame: Frame, colour: str = _MASS) -> list[Any]:
    """The capsule at a frame: its artists, which may be removed again."""
    at, mass = frame.capsule, frame.capsule + frame.mass
    left, right = at - _HALF, at + _HALF
    shell = FancyBboxPatch(
        (left + _ROUND, _ROUND),
        2 * (_HALF - _ROUND),
        _HIGH - _ROUND,
        boxstyle=f"round,pad={_ROUND}",
        facecolor=_SHELL,
        edgecolor=INK,
        linewidth=1.2,
    )
    body = Rectangle(
        (mass - _WIDE, 0.32), 2 * _WIDE, 0.9, facecolor=colour, edgecolor=INK, linewidth=0.8
    )
    plate = max(frame.gap, frame.mass) + at + _WIDE
    stop = Rectangle((plate, 0.42), _STOP, 0.7, facecolor=SOFT, edgecolor="none")
    artists: list[Any] = [axes.add_patch(patch) for patch in (shell, body, stop)]
    # A spring behind lies between the first one and the damper.
    aside = 0.0 if frame.behind is None else 0.12
    springs = [
        (left + _WALL, mass - _WIDE, 0.95 + aside, 7),
        (plate + _STOP, right - _WALL, 0.77, 5),
    ]
    if frame.behind is not None:
        plate = min(-frame.behind, frame.mass) + at - _WIDE
        stop = Rectangle((plate - _STOP, 0.62), _STOP, 0.3, facecolor=SOFT, edgecolor="none")
        artists.append(axes.add_patch(stop))
        springs.append((left + _WALL, plate - _STOP, 0.77, 5))
    for begin, end, height, turns in springs:
        artists += axes.plot(*_spring(begin, end, height, turns), color=INK, linewidth=0.9)
    artists += _damper(axes, left + _WALL, mass - _WIDE, 0.52 - aside)
    return artists


def _spring(begin: float, end: float, height: float, turns: int) -> tuple[Any, Any]:
    share = np.concatenate([[0, 0.12], np.linspace(0.15, 0.85, 2 * turns), [0.88, 1]])
    swing = np.concatenate([[0, 0], np.tile([0.12, -0.12], turns), [0, 0]])
    return begin + (end - begin) * share, height + swing


def _damper(axes: Axes, begin: float, end: float, height: float) -> list[Any]:
    cup = begin + 0.42 * (end - begin), begin + 0.68 * (end - begin)
    rod = begin + 0.55 * (end - begin)
    artists: list[Any] = []
    for x, y in (
        ([begin, cup[0]], [height, height]),
        ([cup[1], cup[0], cup[0], cup[1]], [height + 0.1] * 2 + [height - 0.1] * 2),
        ([rod, end], [height, height]),
        ([rod, rod], [height - 0.07, height + 0.07]),
    ):
        artists += axes.plot(x, y, color=INK, linewidth=0.9)
    return artists


def ground(axes: Axes, left: float, right: float) -> list[Any]:
    """The ground on which the capsule lies, hatched below, and nothing else on the axes."""
    artists: list[Any] = axes.plot([left, right], [0, 0], color=INK, linewidth=1.0)
    artists.append(axes.add_patch(
        Rectangle(
            (left, -0.16), right - left, 0.16, hatch="/////", facecolor="none", edgecolor=SOFT,
            linewidth=0,
        )
    ))  # fmt: skip
    axes.set(xlim=(left, right), ylim=(-0.3, 2.35), aspect="equal")
    axes.set_axis_off()
    return artists


_SLOPE = math.radians(3)  # slope of a track without a device


def _tilt(parameters: SceneParameters, device: SceneDevice | None) -> float:
    """Angle of the track, up the forward direction: a device's, or a small one of its sign."""
    if device is not None:
        return math.atan(device.to_dict().get("slope", 0.0))
    bias = parameters.to_dict().get("s", 0.0)
    return math.copysign(_SLOPE, bias) if bias else 0.0


def _tilted(axes: Axes, artists: list[Any], angle: float) -> list[Any]:
    """The artists, turned by an angle with the track."""
    for artist in artists if angle else ():
        artist.set_transform(Affine2D().rotate(angle) + axes.transData)
    return artists


_PER_SECOND = 20
_SECONDS = 4.0  # of an excitation period
_LARGEST = 1.3  # displacement of the mass in the drawing
_MOST_FRAMES = 2000


@figure_style()
def animate(
    result: Motion,
    path: str | Path,
    *,
    periods: int | None = None,
    colours: Colours = "safe",
    width: float = 6.0,
    dpi: float = 100.0,
    device: SceneDevice | None = None,
) -> None:
    """Write a motion as a GIF or, where the program ffmpeg is installed, as an MP4.

    The capsule moves on the left, the state in the phase portrait on the right, over the last
    `periods` of a run, or over the orbit; in SI units with a `device`. Raises InvalidInput for
    another ending, without ffmpeg for an MP4, and for a path that cannot be written.
    """
    path = Path(path)
    writer, units = _writer(path), Units.of_motion(device, result.parameters)
    drawn = cycle(result) if periods is None else arcs(result, periods)
    time, x_r, v_r, x_c = (
        np.concatenate([getattr(arc, name) for arc in drawn])
        for name in ("time", "x_r", "v_r", "x_c")
    )
    fields = np.concatenate([np.full(len(arc.time), arc.field) for arc in drawn])
    duration = time[-1] - time[0]
    count = max(2, min(_MOST_FRAMES, round(_PER_SECOND * _SECONDS * duration)))
    instants = time[0] + duration * np.arange(count) / count
    scale = _LARGEST / max(float(np.max(abs(x_r))), 1e-300)
    travelled = scale * (x_c - x_c[0])
    check_resolution(dpi)
    figure = StyledFigure(figsize=(width, 0.46 * width))
    left = figure.add_axes((0.01, 0.02, 0.56, 0.8))
    right = figure.add_axes((0.66, 0.15, 0.32, 0.66))
    angle = _tilt(result.parameters, device)
    ends = -3.2 + min(0.0, travelled.min()), 3.2 + max(0.0, travelled.max())
    _tilted(left, ground(left, *ends), angle)
    low, high = left.get_ylim()
    rises = [math.tan(angle) * end for end in ends]
    left.set_ylim(low + min(rises), high + max(rises))
    gap, *behind = (scale * abs(place) for place in stops_of(result.parameters))
    plot_phase_portrait(result, right, periods=periods, colours=colours, device=device)
    if device is None:
        right.set(xlabel="$x_r$", ylabel="$v_r$")
    scene = result.parameters.scene
    add_key(figure, field_handles(figure, colours, scene))
    (dot,) = right.plot([], [], "o", color="black", markersize=5, zorder=9)
    shown: list[Any] = []
    try:
        with whole(path) as part, writer.saving(figure, str(part), dpi):
            for instant in instants:
                for artist in shown:
                    artist.remove()
                at, here = (float(np.interp(instant, time, of)) for of in (travelled, x_r))
                field = int(fields[np.searchsorted(time, instant, side="right") - 1])
                frame = Frame(at, scale * here, gap, *behind)
                colour = field_colour(field, colours, scene)
                shown = _tilted(left, draw_capsule(left, frame, colour), angle)
                fast = float(np.interp(instant, time, v_r))
                dot.set_data([here * units.scale("x_r")], [fast * units.scale("v_r")])
                writer.grab_frame()
    except CalledProcessError as error:
        allowed = f"writable by ffmpeg, which ended with status {error.returncode}"
        raise InvalidInput("out", str(path), allowed) from error


def _writer(path: Path) -> AbstractMovieWriter:
    ending = path.suffix.lower()
    if ending == ".gif":
        return PillowWriter(fps=_PER_SECOND)
    if ending != ".mp4":
        raise InvalidInput("out", str(path), f"a file name that ends in {', '.join(MOVING)}")
    if not FFMpegWriter.isAvailable():
        allowed = "a file name that ends in .gif, as the program ffmpeg is not installed"
        raise InvalidInput("out", str(path), allowed)
    return FFMpegWriter(fps=_PER_SECOND, codec="h264", extra_args=["-pix_fmt", "yuv420p"])
