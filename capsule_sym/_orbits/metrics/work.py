"""Force and work of the drive along any run, periodic or not."""

from __future__ import annotations

import numpy as np

from capsule_sym._arrays import Vector
from capsule_sym._map.backend import backend
from capsule_sym._map.trajectory import Trajectory
from capsule_sym._orbits.metrics.performance import panels
from capsule_sym._orbits.shooting.closed import ClosedForms


def drive_work(run: Trajectory) -> float:
    """Work of the drive over a run, dimensionless, by quadrature."""
    omega, origin = run.parameters.omega, run.span[0]
    records, parts = run.records, list[tuple[Vector, Vector]]()
    with backend("numpy", run.scene) as numbers:
        forms = ClosedForms(numbers, [*run.parameters.to_dict().values()])
        constants = [forms.constants(field) for field in records["field"].tolist()]
        for c, h in zip(constants, records["duration"].tolist(), strict=True):
            fractions, weights = panels(numbers, c, h)
            parts.append((fractions * h, weights * h))
        counts = [len(times) for times, _ in parts]
        begins = np.append(0.0, np.cumsum(records["duration"]))[:-1]
        after = np.concatenate([times for times, _ in parts])
        times = np.minimum(origin + np.repeat(begins, counts) + after, run.span[1])
        _, v_r, v_c = run(times).T
        cosine = np.cos(np.repeat(records["start_angle"], counts) + omega * after)
        power, ends = np.empty_like(times), np.cumsum(counts)
        for c, first, last in zip(constants, ends - counts, ends, strict=True):
            power[first:last] = c.drive_power(cosine[first:last], v_r[first:last], v_c[first:last])
    return float(power @ np.concatenate([weights for _, weights in parts]))


def drive_force(run: Trajectory, times: Vector) -> Vector:
    """Force of the drive on the mass at times of a run, (n,), dimensionless.

    Where a pulse rises or falls it is the force after the edge.
    """
    omega, records = run.parameters.omega, run.records
    begins = run.span[0] + np.append(0.0, np.cumsum(records["duration"]))[:-1]
    index = np.maximum(np.searchsorted(begins, times, side="right") - 1, 0)
    fields, found = records["field"][index], np.empty_like(times)
    with backend("numpy", run.scene) as numbers:
        forms = ClosedForms(numbers, [*run.parameters.to_dict().values()])
        for field in np.unique(fields).tolist():
            these = fields == field
            # Equal to the power at velocity 1 of the mass.
            found[these] = forms.constants(field).drive_power(
                np.cos(omega * times[these]), 1.0, 0.0
            )
    return found
