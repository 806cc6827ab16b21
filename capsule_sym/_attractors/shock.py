"""Minimal shock of a motion: the smallest knock after which it is lost."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from capsule_sym._arrays import Vector
from capsule_sym._attractors.attractor import orbit_record
from capsule_sym._attractors.smallest import ACCURACY, KnockSearch
from capsule_sym._errors import InvalidInput, Status, counted
from capsule_sym._map import Trajectory, simulate
from capsule_sym._map.checks import check_count, checked_seconds, is_real
from capsule_sym._map.evaluation import real
from capsule_sym._map.result import Result, brief
from capsule_sym._native import Watch
from capsule_sym._native.watch import silent
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.search import solve_orbit

_DRAWN = 1e-3  # share of the knock by which the runs that are drawn start beside the boundary
_SHOWN = 64  # excitation periods of these runs


@dataclass(frozen=True, eq=False)
class Shock(Result):
    """Smallest knock after which a motion is lost; dimensionless.

    The knock loses the motion. With the status "found" the motion returns after one smaller by a
    share of 2e-6, and the least size is the same within the relative `accuracy`, unless another
    part of the boundary is nearer. At a time limit the knock is the smallest one so far. If no
    knock was found, `knock`, `phase`, `start`, `state` and `attractor` are None, and `size` is the
    radius up to which knocks were tried, at a time limit that of the ones being tried.
    """

    orbit: Orbit
    """The motion."""
    weights: tuple[float, ...]
    """Weights of the knock's components in its size, shape (3,)."""
    size: float
    """Root of the sum of (weight * component)^2 over the knock's components."""
    knock: Vector | None
    """Change of (x_r, v_r, v_c), shape (3,)."""
    phase: float | None
    """Time of the knock, from 0 to the end of the motion's period."""
    start: Vector | None
    """State of the motion before the knock, shape (3,)."""
    attractor: Orbit | None
    """Attractor of a run from just beyond; None without one, or if the time is up."""
    tried: int
    """Number of knocks tried, not counting bisections and the look for other boundary parts."""
    status: Status
    """Status of the search."""
    message: str
    """Status as a sentence."""
    accuracy: float = ACCURACY
    """Relative accuracy of the size."""
    _recorded = "size accuracy phase tried weights"

    def __repr__(self) -> str:
        return brief(self, str(self.status), f"of size {self.size:.6g}")

    @property
    def state(self) -> Vector | None:
        """State after the knock, next to the boundary, shape (3,); None without a knock."""
        if self.start is None or self.knock is None:
            return None
        return np.asarray(self.start + self.knock)

    @cached_property
    def runs(self) -> tuple[Trajectory, Trajectory]:
        """Runs of 64 excitation periods after knocks that are smaller and larger by 0.1 %.

        Raises InvalidInput if no knock was found.
        """
        if self.start is None or self.knock is None or self.phase is None:
            raise InvalidInput("shock", self, "a result with a knock")
        parameters, phase = self.orbit.parameters, self.phase % self.orbit.parameters.period
        inner, outer = (
            simulate(parameters, (self.start + share * self.knock).tolist(), phase, _SHOWN)
            for share in (1 - _DRAWN, 1 + _DRAWN)
        )
        return inner, outer

    def to_dict(self) -> dict[str, Any]:
        """Result by name, as JSON has it: `orbit` is "motion", and infinite weights are None."""
        scene, orbits = self.orbit.scene, {"motion": self.orbit, "attractor": self.attractor}
        found = {**scene.entry, **super().to_dict(), "parameters": self.orbit.parameters.to_dict()}
        for name in ("knock", "start", "state"):
            state = getattr(self, name)
            values = [] if state is None else zip(scene.facts.STATE, state.tolist(), strict=True)
            found[name] = dict(values) or None
        return found | {name: orbit and orbit_record(orbit) for name, orbit in orbits.items()}


def minimal_shock(
    orbit: Orbit,
    *,
    weights: Sequence[float] = (1.0, 1.0, 1.0),
    largest: float | None = None,
    periods: int | None = None,
    samples: int = 10_000,
    seed: int = 0,
    max_seconds: float = 60.0,
    progress: Callable[[str], object] | None = None,
) -> Shock:
    """Smallest shock, at any time, after which a stable motion is lost.

    A shock is a sudden change of (x_r, v_r, v_c). The motion is lost if it leads to another
    attractor, or has not returned within `periods` excitation periods. Shocks at all times of the
    motion's period are tried, of growing size, up to `largest`. The smallest ones that lose the
    motion, in up to six directions, are made smaller by random changes of time and direction,
    while one of them still loses it. At the end `samples` smaller shocks are tried, none of which
    loses the motion.

    The shock leads to the nearest point of the boundary, within 1e-4 of its size. It is not proved
    that no other part of the boundary is nearer. A run is computed in parts of growing length. It
    counts as one that returns if the core cannot decide more than 100 segments of a part, or if a
    part is not over within a tenth of the time left. After `max_seconds` the result is the best so
    far.

    Parameters
    ----------
    orbit : Orbit
        The motion: a stable periodic orbit.
    weights : sequence of float, shape (3,), default (1, 1, 1), each above 0
        Weights of the components of a shock, numbers without unit. The size of a shock is the root
        of the sum of (weight * component)^2. A component of infinite weight is 0; not all weights
        are infinite.
    largest : float, optional, finite and above 0
        Largest size that is tried, dimensionless. The default is 4 (1 + m) times the least weight,
        where m is the largest absolute value of x_r, v_r and v_c on the motion.
    periods : int, optional, 64 to 1,000,000
        Excitation periods within which a motion has to return. The default is 1024 plus the time in
        which the motion attracts by e^20.
    samples : int, default 10,000, 100 to 10,000,000
        Number of smaller shocks that are tried at the end.
    seed : int, default 0, 0 to 2^63
        Seed of the random shocks.
    max_seconds : float, default 60, above 0
        Time limit, in seconds of wall time.
    progress : callable, optional
        Function that is called with a text.

    Returns
    -------
    Shock
        `knock` is the change of the state, `size` its size, `phase` its time, `start` the state
        before it, `attractor` the motion beyond, None if it is not periodic or the time is up.
        Without a shock they are None, except `size`, the largest tried. `status` is "found",
        "not-lost" if no shock up to `largest` loses the motion, or "time-limit". All quantities are
        dimensionless.

    Raises
    ------
    InvalidInput
        For a value outside its range, and an orbit that is not stable.

    See Also
    --------
    plot : figure of the result.
    attractors : attractors that starts lead to.

    Examples
    --------
    Smallest change of the relative velocity alone, as by a blow on the mass:

    >>> import capsule_sym as cs
    >>> system = cs.Parameters(alpha=2.4, omega=0.9, delta=0.3, zeta=0.08, beta=48.0, gamma=5.0)
    >>> box = {"x_r": (-2, 2), "v_r": (-2, 2)}
    >>> fast, slow = (one.orbit for one in cs.attractors(system, box, count=40).attractors)
    >>> inf = float("inf")
    >>> shock = cs.minimal_shock(slow, weights=(inf, 1, inf), samples=100)
    >>> print(shock.status, round(shock.size, 4))
    found 0.1191
    >>> print([round(float(orbit.progression), 4) for orbit in (slow, shock.attractor)])
    [0.5516, -0.7019]
    """
    if periods is not None:
        check_count("periods", periods, 64, 10**6)
    check_count("samples", samples, 100, 10**7)
    check_count("seed", seed, 0, 2**63)
    units = _units(weights)
    if largest is not None and not (is_real(largest) and 0 < largest < math.inf):
        raise InvalidInput("largest", largest, "a finite number > 0")
    search, settled = KnockSearch(orbit, units, largest, periods, seed), None
    with Watch(checked_seconds(max_seconds)):
        search.run(samples, progress or silent)
        if search.best is not None:
            (time,), _, (state,) = search.starts(search.best[None])
            settled = solve_orbit(orbit.parameters, state, time % search.period, search.periods)
    found: dict[str, Any] = dict.fromkeys(("knock", "phase", "start"))
    if search.best is not None:
        (time,), (start,), (state,) = search.starts(search.best[None])
        found = {"knock": state - start, "phase": float(time), "start": start}
    return Shock(
        orbit=search.orbit,
        weights=tuple(weights),
        size=search.radius,
        attractor=settled if settled and settled.success else None,
        tried=search.tried,
        status=search.status,
        message=_message(search, samples, settled),
        **found,
    )


def _units(weights: Sequence[float]) -> Vector:
    """Knocks of size 1 along each allowed component, shape (3, m)."""
    allowed = "three numbers > 0, inf for a component without a knock, not all inf"
    given = real("weights", weights, allowed)
    if given.shape != (3,) or not (given > 0).all() or np.isinf(given).all():
        raise InvalidInput("weights", weights, allowed)
    return np.diag(1 / given)[:, np.isfinite(given)]


def _message(search: KnockSearch, samples: int, settled: Orbit | None) -> str:
    """Status of a search, as a sentence, by what a run beyond the knock settles on."""
    tried = counted(search.tried, "knock")
    if search.status is Status.NOT_LOST:
        return f"none of {tried} up to {search.radius:.6g} loses the motion"
    if search.best is None:
        return "time limit reached before a knock was found that loses the motion"
    if search.status is Status.TIME_LIMIT:
        return f"time limit reached: smallest of {tried} so far"
    where = "no periodic motion" if settled else "a motion that is unknown: the time was up"
    if settled and settled.success:
        where = "another motion"
    smaller = counted(samples, "smaller knock")
    return f"runs beyond it lead to {where}; the motion returns after {smaller}"
