"""Metrics of many motions, as they stand in the records of the core."""

from collections.abc import Sequence

import numpy as np

from capsule_sym import Parameters
from capsule_sym._attractors.neighbourhoods import MOST_OPEN
from capsule_sym._design.evaluation import settle_many
from capsule_sym._orbits.metrics.many import METRICS


def metrics_of(systems: Sequence[Parameters]) -> list[dict[str, float]]:
    """The metrics of each system's motion from rest, by name; empty where it does not settle."""
    rows = np.array([list(system.to_dict().values()) for system in systems])
    found = settle_many(
        rows, (0.0, 0.0, 0.0), stretches=(64, 128, MOST_OPEN), scene=systems[0].scene
    )
    return [
        dict(zip(METRICS, values, strict=True)) if number else {}
        for values, number in zip(found.found.values.tolist(), found.period_numbers, strict=True)
    ]
