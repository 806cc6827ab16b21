"""The text of a run: the segments of its last motion."""

from __future__ import annotations

from collections.abc import Sequence

import capsule_sym
from capsule_sym._errors import counted
from capsule_sym._parameters import SceneDevice
from capsule_sym._texts import tables


def show_run(
    trajectory: capsule_sym.results.Trajectory,
    motion: capsule_sym.results.SteadyMotion | None,
    physical: SceneDevice | None,
) -> None:
    """Print the segments of the steady motion, or of the last period."""
    from capsule_sym._map.drift import dragged
    from capsule_sym._map.steady import shown_progression

    console = tables.make_console()
    values = trajectory.parameters.to_dict().items()
    console.print("  ".join(f"{name} = {value:.6g}" for name, value in values))
    console.print()
    if motion is None:
        (count, phase), _ = trajectory.final
        periods = counted(count, "period")
        if not trajectory.success:
            console.print(f"Stopped at phase {float(phase):.5f} after {periods},")
            console.print(f"{trajectory.message}.")
        else:
            how = "more --periods, or capsule-sym orbit, which solves the orbit of a slow approach"
            why = dragged(trajectory.parameters) or how
            console.print(f"Not steady within {periods}: {why}.", soft_wrap=True)
        console.print("The segments of the last period:")
        segments = [s for s in trajectory.segments if s.end >= (count - 1, phase)]
        _show_segments(segments, physical)
        return
    console.print("The segments of the steady motion:")
    _show_segments(motion.segments, physical)
    console.print()
    console.print(f"global map     {motion.global_map}")
    console.print(f"period number  {motion.period_number}")
    progression = shown_progression(motion)
    console.print(f"progression    {progression:.10g} per excitation period")
    if physical:
        advance = physical.displacement(progression)
        period = physical.time(trajectory.parameters.period)
        console.print(f"               {advance:.6g} m in {period:.6g} s")
        console.print(f"velocity       {advance / period:.6g} m/s on average")


def _show_segments(
    segments: Sequence[capsule_sym.results.Segment], physical: SceneDevice | None
) -> None:
    def row(segment: capsule_sym.results.Segment) -> tuple[str, ...]:
        duration = float(segment.duration)
        if physical:
            duration = 1e3 * physical.time(duration)
        values = (segment.start.phase, duration, *segment.start_state)
        return (
            f"{segment.name} {segment.mode}",
            segment.local_map if segment.source and segment.target else "",
            segment.source,
            segment.target,
            *(f"{float(value):.5f}" for value in values),
        )

    numbers = ("phase", "ms" if physical else "duration", "x_r", "v_r", "v_c")
    names = ("segment", "local map", "entry", "exit", *numbers)
    tables.table(names, map(row, segments), right=numbers, gap=0)
