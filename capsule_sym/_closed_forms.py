"""Closed form of a segment and its Jacobian, in doubles by NumPy or in the numbers of a library.

This module chooses between series, closed forms and doubling, and evaluates lanes by their cases.
The generator writes the response functions, to `generated.basis` for all scenes, and the flow in
terms of them, to the `kernels` of each scene.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from capsule_sym.generated import basis as _basis

basis: Any = _basis  # what is printed has no types
Terms = list[Any]
# Cases of the response functions; from _CONFLUENT on, the number of doublings is added.
_SHORT, _FREE_SERIES, _OSCILLATING, _OVERDAMPED, _CONFLUENT = range(5)


class Start(NamedTuple):
    """Start of a segment: its state, with its exactly known facts.

    `gap` is x_r less the place of the stop (exactly 0 on the impact surface), `margin` the
    interaction force minus friction (exactly 0 where a slip begins), theta the forcing angle.
    """

    x_r: Any
    gap: Any
    v_r: Any
    v_c: Any
    margin: Any
    cos_theta: Any
    sin_theta: Any


class Doubles:
    """Functions by NumPy, of scalars and of arrays with a lane for each segment."""

    cos, exp, expm1, sin, sqrt = np.cos, np.exp, np.expm1, np.sin, np.sqrt
    any, larger, largest = staticmethod(np.any), np.maximum, staticmethod(np.max)
    tiny = 1e-300
    terms: int = basis.SERIES_TERMS

    def doublings(self, reach: Any) -> Any:
        """Doublings after which a duration is 1 over its rate or less."""
        return np.ceil(np.log2(np.maximum(reach, 1.0))).astype(int)

    def rows(self, flat: Sequence[Any], width: int) -> Any:
        """Array of shape (rows, width) + lanes from all entries."""
        values = np.stack(np.broadcast_arrays(*flat))
        return values.reshape(-1, width, *values.shape[1:])


class Digits:
    """Functions of a library of many digits by mpmath's names, at its working precision."""

    any, larger, largest = bool, max, staticmethod(lambda value: value)

    def __init__(self, functions: Any) -> None:
        self._functions = functions
        for name in ("cos", "exp", "expm1", "sin", "sqrt"):
            setattr(self, name, getattr(functions, name))

    @property
    def tiny(self) -> Any:
        """Number that stands for 0 under a root."""
        return self._functions.ldexp(1, -4 * self._functions.prec)

    @property
    def terms(self) -> int:
        """Terms that the series need, for rate * h < 1."""
        n, term = 8, self._functions.mpf(1) / 40320
        while (n + 1) * term > self._functions.eps:
            n, term = n + 1, term / (n + 1)
        return n + 2

    def doublings(self, reach: Any) -> int:
        """Doublings after which a duration is 1 over its rate or less."""
        n = 0
        while reach > 1:
            reach, n = reach / 2, n + 1
        return n

    def rows(self, flat: Sequence[Any], width: int) -> list[list[Any]]:
        """Rows of this width from all entries."""
        return [list(flat[i : i + width]) for i in range(0, len(flat), width)]


def kernels_of(code: ModuleType, pulsed: bool, functions: Any = None) -> Kernels:
    """Kernels of a scene's generated code, by NumPy or by functions of mpmath's names."""
    numbers = Doubles() if functions is None else Digits(functions)
    return (Kernels if pulsed else Harmonic)(code, numbers)


class Kernels:
    """Kernels of a scene whose drive is constant within a segment.

    Durations, starts and constants are numbers; by NumPy they may also be one-dimensional arrays of
    one common length, but for contact and drift.
    """

    JET_ORDER: int = basis.JET_ORDER

    def __init__(self, code: Any, numbers: Any) -> None:
        self.code, self.numbers, self.Start = code, numbers, Start
        self.Constants, self.JACOBIAN_COLUMNS = code.Constants, code.JACOBIAN_COLUMNS
        self.jet, self.jet_magnitudes = code.jet, code.jet_magnitudes

    def constants(self, field: int, *parameters: Any, **named: Any) -> Any:
        """Constants of the segment of field Fn by its number n."""
        own = self.code.own_constants(field, *parameters, **named)
        return self.Constants(
            *own, *self._rates(dict(zip(self.Constants._fields, own, strict=False)))
        )

    @np.errstate(under="ignore")  # what has decayed is 0, also where a user's setting raises
    def flow(self, c: Any, start: Start, h: Any, advance: bool = False) -> Any:
        """x_r(h) - x_r(0), v_r(h), in drift v_c(h) - v_c(0); with `advance` x_c(h) - x_c(0) too."""
        case = _either(c.rate * h < 1.0, _SHORT, self._flow_case(c, h))
        return _by_case(self._flow, case, c, start, h, advance)

    @np.errstate(under="ignore")
    def jacobian(self, c: Any, start: Start, h: Any) -> Any:
        """Derivatives of (x_r, v_r), in drift also of v_c and of x_c's advance, at h, row by row.

        Columns as in JACOBIAN_COLUMNS; by NumPy an array, with lanes along its last axis.
        """
        flat = _by_case(self._jacobian, self._jacobian_case(c, h), c, start, h)
        return self.numbers.rows(flat, len(self.JACOBIAN_COLUMNS))

    def _rates(self, known: dict[str, Any]) -> tuple[Any, ...]:
        """Constants q, nu, slow, fast and rate, from those of the equations of motion."""
        sigma, K, by = known["sigma"], known["K"], self.numbers
        q = K - sigma * sigma
        nu = by.sqrt(by.larger(abs(q), by.tiny))  # where q = 0, sin(nu h)/nu is h to the last digit
        fast = _either(q < 0.0, sigma + nu, by.sqrt(K))
        return q, nu, -K / (sigma + nu), fast, fast

    def _flow_case(self, c: Any, h: Any) -> Any:
        """Cases of durations that are not short."""
        free = _either(c.q < 0.0, _OVERDAMPED, _OSCILLATING)
        return _either(c.fast * h < 1.0, _FREE_SERIES, free)

    _jacobian_case = _flow_case

    def forcing(self, c: Any, h: Any) -> tuple[Any, ...]:
        """Functions of the forcing, of which a constant drive has none."""
        return ()

    def integrals(self, c: Any, h: Any, forcing: tuple[Any, ...]) -> tuple[Any, ...]:
        """Integrals of the forcing, of which a constant drive has none."""
        return ()

    def free_terms(self, c: Any, h: Any) -> Terms:
        """Terms Gd^(n) h^n / n! of the power series."""
        a, b = 2 * c.sigma * h, c.K * h * h
        d = [1.0 + 0 * h, -a]
        for n in range(2, self.numbers.terms):
            d.append(-(a * d[n - 1] + b * d[n - 2] / (n - 1)) / n)
        return d

    def slope_terms(self, c: Any, h: Any, d: Terms) -> Terms:
        """Terms of the power series of G2d."""
        a, b, hh = 2 * c.sigma * h, c.K * h * h, h * h
        z = [0 * h, 0 * h]
        for n in range(2, len(d)):
            z.append((hh * d[n - 2] / (n - 1) - a * z[n - 1] - b * z[n - 2] / (n - 1)) / n)
        return z

    def series(self, c: Any, h: Any) -> tuple[Any, ...]:
        """G, Gd, H and H1 by their power series in h."""
        return _free_sums(self.free_terms(c, h), h)

    def sensitivity_series(self, c: Any, h: Any) -> tuple[Any, ...]:
        """G2, G2d and H2 by their power series in h."""
        return _slope_sums(self.slope_terms(c, h, self.free_terms(c, h)), h)

    def _free(self, case: int, c: Any, h: Any) -> tuple[Any, ...]:
        """G, Gd and H by series or closed forms."""
        if case == _FREE_SERIES:
            return self.series(c, h)[:3]
        closed = basis.oscillating if case == _OSCILLATING else basis.overdamped
        return closed(self.numbers, c, h)  # type: ignore[no-any-return]

    def _responses(
        self, case: int, c: Any, h: Any, forcing: tuple[Any, ...]
    ) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        """Response functions, and for a short duration those that v_c needs."""
        if case == _SHORT:
            G, Gd, H, H1 = self.series(c, h)
            return (G, Gd, H), (H, H1)
        return self._free(case, c, h), ()

    def _free_slopes(self, c: Any, h: Any, free: tuple[Any, ...], near: Any) -> tuple[Any, ...]:
        """G2, G2d and H2 by closed forms, or by doubling near a confluence."""
        apart = basis.free_slopes_apart(c._replace(q=_either(near, 1.0, c.q)), h, *free)
        if not self.numbers.any(near):
            return apart  # type: ignore[no-any-return]
        part = _either(near, h, 0.0)
        doublings = self.numbers.doublings(self.numbers.largest(c.fast * part))
        G, Gd, H = self.series(c, part / 2**doublings)[:3]
        doubled = self.sensitivity_series(c, part / 2**doublings)[:3]
        for _ in range(doublings):
            doubled = basis.free_slopes_doubled(c, G, Gd, H, *doubled)
            G, Gd, H = basis.free_doubled(c, G, Gd, H)
        return tuple(_either(near, a, b) for a, b in zip(doubled, apart, strict=True))

    def _with_slopes(
        self, case: int, c: Any, h: Any, forcing: tuple[Any, ...], integrals: tuple[Any, ...]
    ) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        """Response functions and their sensitivities.

        Closed sensitivities cancel more, by a power of the duration: they are used later, and never
        if strong damping makes K small compared with sigma^2.
        """
        free = self._free(case, c, h)
        near = (c.q < 0.0) | (c.rate * h < 8.0) | (abs(c.q) * h * h < 1.0)
        return free, self._free_slopes(c, h, free, near)

    def _flow(self, case: int, c: Any, start: Start, h: Any, advance: bool) -> tuple[Any, ...]:
        x_r, gap, v_r, v_c, margin, *angle = start
        forcing = self.forcing(c, h) if case != _SHORT or advance else ()
        response, short = self._responses(case, c, h, forcing)
        position, velocity = self.code.relative_flow(c, x_r, gap, v_r, *angle, *response)
        if c.drift == 0:
            return position, velocity
        if case == _SHORT:
            change = self.code.drift_short(c, x_r, gap, v_r, margin, *angle, h, *short)
        else:
            change = self.code.drift_long(c, v_r, velocity, *angle, h, *forcing[1:])
        if not advance:
            return position, velocity, *change
        lag = self.integrals(c, h, forcing)[:1]
        gained = self.code.capsule_advance(c, v_r, v_c, position, *angle, h, *forcing[2:], *lag)
        return position, velocity, *change, *gained

    def _jacobian(self, case: int, c: Any, start: Start, h: Any) -> Sequence[Any]:
        x_r, gap, v_r, v_c, _, *angle = start
        forcing = self.forcing(c, h)
        integrals = self.integrals(c, h, forcing)
        response, slopes = self._with_slopes(case, c, h, forcing, integrals)
        if c.drift == 0:
            return self.code.jacobian_stick(c, x_r, gap, v_r, *angle, *response, *slopes)  # type: ignore[no-any-return]
        known = *response, *forcing, *integrals, *slopes
        return self.code.jacobian_drift(c, x_r, gap, v_r, v_c, *angle, h, *known)  # type: ignore[no-any-return]


class Harmonic(Kernels):
    """Kernels of a scene whose drive is alpha cos(theta)."""

    def _rates(self, known: dict[str, Any]) -> tuple[Any, ...]:
        """Constants q, nu, slow, Z2, resonant, fast and rate."""
        q, nu, slow, fast, _ = super()._rates(known)
        sigma, K, omega = known["sigma"], known["K"], known["omega"]
        detuning = K - omega * omega
        Z2 = detuning * detuning + 4.0 * sigma * sigma * omega * omega
        total = K + omega * omega
        rate = self.numbers.larger(fast, omega)
        resonant = total * total > 2.0 * Z2
        return q, nu, slow, Z2, resonant, fast, rate

    def _flow_case(self, c: Any, h: Any) -> Any:
        return self._case(c, h, c.resonant)

    def _jacobian_case(self, c: Any, h: Any) -> Any:
        # As in `_with_slopes`.
        strong = (c.q < 0.0) & (c.omega < c.fast)
        return self._case(c, h, c.resonant | strong | (c.rate * h < 8.0))

    def _case(self, c: Any, h: Any, confluent: Any) -> Any:
        doubled = _CONFLUENT + self.numbers.doublings(c.rate * h)
        return _either(confluent, doubled, super()._flow_case(c, h))

    def forcing(self, c: Any, h: Any) -> tuple[Any, ...]:
        """Cosine, sine and versine of the forcing."""
        cos, sin = self.numbers.cos, self.numbers.sin
        half = sin(c.omega * h / 2) / c.omega
        return cos(c.omega * h), sin(c.omega * h) / c.omega, 2 * half * half

    def integrals(self, c: Any, h: Any, forcing: tuple[Any, ...]) -> tuple[Any, ...]:
        """Functions lag, sine2, versine2 and lag2 of the forcing."""
        cosine, sine, versine = forcing
        ww = c.omega * c.omega
        lag, sine2 = (h - sine) / ww, (sine - h * cosine) / (2 * ww)
        closed = lag, sine2, (versine - h * sine / 2) / ww, (lag - sine2) / ww
        # All four differences cancel at small angles; power series are used there.
        small = c.omega * h < 2
        if not self.numbers.any(small):
            return closed
        angle = _either(small, c.omega * h, 0)
        series = self.forcing_series(angle * angle, h)
        return tuple(_either(small, a, b) for a, b in zip(series, closed, strict=True))

    def forcing_series(self, power: Any, h: Any) -> tuple[Any, ...]:
        """The same by their power series, from the squared angle."""
        term = h * h * h / 6
        lag = sine2 = term
        versine2 = term * h / 4
        lag2 = versine2 * h / 5
        for n in range(1, self.numbers.terms):
            term = -term * power / ((2 * n + 2) * (2 * n + 3))
            lag = lag + term
            slope = (n + 1) * term
            sine2 = sine2 + slope
            slope = slope * h / (2 * n + 4)
            versine2, lag2 = versine2 + slope, lag2 + slope * h / (2 * n + 5)
        return lag, sine2, versine2, lag2

    def forced_terms(self, c: Any, h: Any, d: Terms) -> Terms:
        """Terms Bdd^(n) h^n / n! of the power series."""
        w, y = (c.omega * h) ** 2, [0 * h, h]
        for n in range(2, len(d)):
            y.append((h * d[n - 1] - w * y[n - 2] / (n - 1)) / n)
        return y

    def series(self, c: Any, h: Any) -> tuple[Any, ...]:
        """G, Gd, H, H1, B, Bd, Bdd and BI by their power series in h."""
        d = self.free_terms(c, h)
        Bdd, Bd, B, BI = _sums(self.forced_terms(c, h, d))
        hh = h * h
        return *_free_sums(d, h), hh * B, h * Bd, Bdd, hh * h * BI

    def sensitivity_series(self, c: Any, h: Any) -> tuple[Any, ...]:
        """G2, G2d, H2, B2, B2d, BW and BWd by their power series in h."""
        w, hh, d = (c.omega * h) ** 2, h * h, self.free_terms(c, h)
        y, z = self.forced_terms(c, h, d), self.slope_terms(c, h, d)
        r, u = [0 * h, 0 * h], [0 * h, 0 * h]  # of B2d and BWd
        for n in range(2, len(d)):
            r.append((hh * z[n - 2] - w * r[n - 2]) / (n * (n - 1)))
            source = hh * h * y[n - 3] / (n - 2) if n > 2 else 0 * h
            u.append((source - w * u[n - 2]) / (n * (n - 1)))
        B2d, B2, _, _ = _sums(r)
        BWd, BW, _, _ = _sums(u)
        return *_slope_sums(z, h), h * B2, B2d, h * BW, BWd

    def _responses(
        self, case: int, c: Any, h: Any, forcing: tuple[Any, ...]
    ) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        if case == _SHORT:
            G, Gd, H, H1, B, Bd, Bdd, BI = self.series(c, h)
            return (G, Gd, H, B, Bd, Bdd), (H, H1, B, Bd, BI)
        if case >= _CONFLUENT:
            return self._doubled(c, h, case - _CONFLUENT, False)
        free = self._free(case, c, h)
        return (*free, *basis.detached(c, *free, *forcing)), ()

    def _doubled(
        self, c: Any, h: Any, doublings: int, sensitive: bool
    ) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        """Response functions, and all sensitivities on request, from series at a part of h."""
        h = h / 2**doublings
        G, Gd, H, _, B, Bd, Bdd, _ = self.series(c, h)
        slopes = self.sensitivity_series(c, h) if sensitive else ()
        for _ in range(doublings):
            forcing = cosine, sine, _ = self.forcing(c, h)
            if sensitive:
                sine2 = self.integrals(c, h, forcing)[1]
                known = G, Gd, H, B, Bd, Bdd, cosine, sine, sine2
                forced = basis.forced_slopes_doubled(c, h, *known, *slopes)
                slopes = *basis.free_slopes_doubled(c, G, Gd, H, *slopes[:3]), *forced
            B, Bd = basis.forced_doubled(c, G, Gd, H, B, Bd, Bdd, cosine, sine)
            G, Gd, H = basis.free_doubled(c, G, Gd, H)
            Bdd = G - c.omega * c.omega * B
            h = 2 * h
        return (G, Gd, H, B, Bd, Bdd), slopes

    def _with_slopes(
        self, case: int, c: Any, h: Any, forcing: tuple[Any, ...], integrals: tuple[Any, ...]
    ) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        """Response functions and sensitivities, near critical damping the free ones by doubling."""
        if case >= _CONFLUENT:
            return self._doubled(c, h, case - _CONFLUENT, True)
        response, _ = self._responses(case, c, h, forcing)
        G, Gd, H, B, Bd, Bdd = response
        free = self._free_slopes(c, h, (G, Gd, H), abs(c.q) * h * h < 1.0)
        known = G, B, Bd, Bdd, *forcing[:2], integrals[1], *free[:2]
        return response, (*free, *basis.forced_slopes_apart(c, h, *known))


def _either(condition: Any, first: Any, second: Any) -> Any:
    """Choice by a condition, lane by lane if it is an array."""
    if isinstance(condition, np.ndarray):
        return np.where(condition, first, second)
    return first if condition else second


def _sums(terms: Terms) -> tuple[Any, ...]:
    """Sum of the terms, and of the terms once, twice and thrice integrated, over powers of h."""
    plain = once = twice = thrice = 0.0
    for n in reversed(range(len(terms))):
        term = terms[n]
        plain = plain + term
        term = term / (n + 1)
        once = once + term
        term = term / (n + 2)
        twice = twice + term
        thrice = thrice + term / (n + 3)
    return plain, once, twice, thrice


def _free_sums(d: Terms, h: Any) -> tuple[Any, ...]:
    Gd, G, H, H1 = _sums(d)
    hh = h * h
    return h * G, Gd, hh * H, hh * h * H1


def _slope_sums(z: Terms, h: Any) -> tuple[Any, ...]:
    G2d, G2, H2, _ = _sums(z)
    return h * G2, G2d, h * h * H2


def _by_case(
    function: Callable[..., Sequence[Any]], cases: Any, c: Any, start: Start, h: Any, *options: bool
) -> Any:
    """Values of a function of one case, on the lanes that are in it."""
    if getattr(cases, "ndim", 0) == 0:
        return function(int(cases), c, start, h, *options)
    lanes = cases.shape

    def part(values: Any, chosen: Any) -> Any:
        return type(values)(*(v[chosen] if np.ndim(v) else v for v in values))

    results: Any = None
    for case in np.unique(cases):
        chosen = cases == case
        at = part(c, chosen), part(start, chosen), np.broadcast_to(h, lanes)[chosen]
        values = function(int(case), *at, *options)
        if results is None:
            results = tuple(np.empty(lanes) for _ in values)
        for result, value in zip(results, values, strict=True):
            result[chosen] = value
    return results
