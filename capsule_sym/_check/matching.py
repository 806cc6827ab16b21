"""Two lists of switches matched: which are the same, which are missed, which are invented."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from capsule_sym._map.labelled import package

if TYPE_CHECKING:
    from pandas import DataFrame


def matched(exact: DataFrame, given: DataFrame, slack: float, until: float = math.inf) -> DataFrame:
    """Switches of two lists side by side, a row for each, in the order of time.

    The lists have ascending times, `exact` and `given`, and what happens, `event`. Switches are the
    same if this is, if each is the other's nearest one, if their times differ by at most `slack`,
    and if pairs have the same order in both lists. Times are nan where a list has no such switch;
    `place` is that in the exact list. Without another one an exact switch after `until` is left
    out, a given one is kept.
    """
    pandas = package("pandas")
    exact, given = exact.assign(place=range(len(exact))), given.assign(row=range(len(given)))
    near: dict[str, Any] = {"by": "event", "direction": "nearest", "tolerance": slack}
    there = pandas.merge_asof(exact, given, left_on="exact", right_on="given", **near)
    back = pandas.merge_asof(given, exact, left_on="given", right_on="exact", **near)
    both = there.merge(back[["place", "row"]], on=["place", "row"])
    both = both[both["row"] == both["row"].cummax()]  # in the same order
    missed = exact[~exact["place"].isin(both["place"]) & (exact["exact"] <= until)]
    found = pandas.concat([both, missed, given[~given["row"].isin(both["row"])]])
    order = found["exact"].fillna(found["given"]).argsort(kind="stable")
    made: DataFrame = found.iloc[order].drop(columns="row").reset_index(drop=True)
    return made
