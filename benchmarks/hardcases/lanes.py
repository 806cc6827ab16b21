"""First switches of runs that go side by side in lanes, each among others of its flow."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from benchmarks.hardcases.reference import Start
from capsule_sym._map.interface import Backend, Number, core


class LaneSwitch(NamedTuple):
    """The first switch of a run: the field before it, the plane (0: none comes), and the duration.

    `field` is 0 if there is no switch or the run does not give it; `alone` is true if the lanes
    left it to the code for one run.
    """

    field: int
    plane: int
    duration: Number
    alone: bool


def first_switch(numbers: Backend, start: Start, lanes: int) -> LaneSwitch | None:
    """The first switch of a start in one of `lanes` lanes; None if the core cannot decide.

    The others hold runs from displaced states, most of them in the same field. `numbers` gives the
    duration its digits.
    """
    p, (x_r, v_r, v_c) = start.parameters, start.state
    own = hash(start.state) % lanes
    off = 0.01 * np.arange(1, lanes + 1)
    off[own] = 0.0
    away, onward = (1.0 if x_r > p.delta else -1.0), (v_c > 0) - (v_c < 0)
    starts = np.column_stack([x_r + away * off, np.full(lanes, v_r), v_c + onward * off])
    rows = np.tile(list(p.to_dict().values()), (lanes, 1))
    records, events = np.empty(lanes, core().records.STATE), np.zeros(lanes, core().records.EVENT)
    core().start_many(rows, starts, np.full(lanes, start.phase), records)
    stops = np.zeros(lanes, np.int8)
    core().run_many(rows, records, start.periods, stops, lanes=lanes, first=events)
    stop = stops[own]
    event, end = events[own], records[own]
    if stop == core().OPEN:
        return None
    if not event["field"]:
        return LaneSwitch(int(end["field"]), 0, numbers.number(0), False)
    angle = numbers.number(float(end["angle"])) + numbers.number(float(end["angle_rest"]))
    turned = int(end["period"]) * numbers.full_turn + angle
    began = numbers.number(start.phase) * numbers.number(p.omega)
    duration = (turned - began) / numbers.number(p.omega)
    return LaneSwitch(int(event["field"]), int(event["plane"]), duration, bool(end["plane"]))
