"""A steady motion as an animation: the capsule as it moves, beside its phase portrait."""

from __future__ import annotations

from pathlib import Path
from subprocess import CalledProcessError
from typing import TYPE_CHECKING, Any

import numpy as np

from capsule_sym._errors import InvalidInput
from capsule_sym._figures.device import Frame, draw_capsule, ground
from capsule_sym._figures.layout import add_key
from capsule_sym._figures.pages import new_figure
from capsule_sym._figures.portraits import field_handles, plot_phase_portrait
from capsule_sym._figures.sizes import MOVING
from capsule_sym._figures.style import Colours, field_colour, figure_style
from capsule_sym._figures.units import Units
from capsule_sym._files import whole
from capsule_sym._parameters import PhysicalParameters
from capsule_sym._study.arcs import Motion, arcs, cycle

if TYPE_CHECKING:
    from matplotlib.animation import AbstractMovieWriter

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
    device: PhysicalParameters | None = None,
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
    figure = new_figure(width, 0.46 * width)
    left = figure.add_axes((0.01, 0.02, 0.56, 0.8))
    right = figure.add_axes((0.66, 0.15, 0.32, 0.66))
    ground(left, -3.2 + min(0.0, travelled.min()), 3.2 + max(0.0, travelled.max()))
    plot_phase_portrait(result, right, periods=periods, colours=colours, device=device)
    if device is None:
        right.set(xlabel="$x_r$", ylabel="$v_r$")
    add_key(figure, field_handles(figure, colours))
    (dot,) = right.plot([], [], "o", color="black", markersize=5, zorder=9)
    shown: list[Any] = []
    try:
        with whole(path) as part, writer.saving(figure, str(part), dpi):
            for instant in instants:
                for artist in shown:
                    artist.remove()
                at, here = (float(np.interp(instant, time, of)) for of in (travelled, x_r))
                field = int(fields[np.searchsorted(time, instant, side="right") - 1])
                frame = Frame(at, scale * here, scale * result.parameters.delta)
                shown = draw_capsule(left, frame, field_colour(field, colours))
                fast = float(np.interp(instant, time, v_r))
                dot.set_data([here * units.scale("x_r")], [fast * units.scale("v_r")])
                writer.grab_frame()
    except CalledProcessError as error:
        allowed = f"writable by ffmpeg, which ended with status {error.returncode}"
        raise InvalidInput("out", str(path), allowed) from error


def _writer(path: Path) -> AbstractMovieWriter:
    from matplotlib.animation import FFMpegWriter, PillowWriter

    ending = path.suffix.lower()
    if ending == ".gif":
        return PillowWriter(fps=_PER_SECOND)
    if ending != ".mp4":
        raise InvalidInput("out", str(path), f"a file name that ends in {', '.join(MOVING)}")
    if not FFMpegWriter.isAvailable():
        allowed = "a file name that ends in .gif, as the program ffmpeg is not installed"
        raise InvalidInput("out", str(path), allowed)
    return FFMpegWriter(fps=_PER_SECOND, codec="h264", extra_args=["-pix_fmt", "yuv420p"])
