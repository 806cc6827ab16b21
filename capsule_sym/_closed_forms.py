"""Closed form of a segment and its Jacobian, in doubles or in the numbers of a library.

This module chooses between series, closed forms and doubling. The generator writes the response
functions, to `generated.basis` for all scenes, and the flow in terms of them, to the `kernels` of
each scene.
"""

from __future__ import annotations

import math
from functools import cache
from itertools import count
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from capsule_sym.generated import basis as _basis

basis: Any = _basis  # what is printed has no types
Terms = list[Any]
Values = tuple[Any, ...]
_DOUBLES = SimpleNamespace(prec=53, **vars(math))


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


class Kernels:
    """Kernels of a scene whose drive is constant within a segment.

    Durations, starts and constants are numbers, of which `by` has the functions.
    """

    JET_ORDER: int = basis.JET_ORDER

    def __init__(self, code: Any, by: Any = _DOUBLES) -> None:
        self.code, self.by, self.Start = code, by, Start
        self.Constants, self.JACOBIAN_COLUMNS = code.Constants, code.JACOBIAN_COLUMNS
        self.jet, self.jet_magnitudes = code.jet, code.jet_magnitudes

    @property
    def terms(self) -> int:
        """Terms that the series need, for rate * h < 1."""
        return _terms(self.by.prec)

    def constants(self, field: int, *parameters: Any, **named: Any) -> Any:
        """Constants of the segment of field Fn by its number n."""
        own = self.code.own_constants(field, *parameters, **named)
        return self.Constants(
            *own, *self._rates(dict(zip(self.Constants._fields, own, strict=False)))
        )

    @np.errstate(under="ignore")  # what has decayed is 0, also where a user's setting raises
    def flow(self, c: Any, start: Start, h: Any, advance: bool = False) -> Values:
        """x_r(h) - x_r(0) and v_r(h); in drift v_c(h) - v_c(0), with `advance` x_c(h) - x_c(0) too.

        At rest there are two values, also with `advance`.
        """
        x_r, gap, v_r, v_c, margin, *angle = start
        short = c.rate * h < 1
        forcing = () if short and not advance else self.forcing(c, h)
        response, rest = self.short(c, h) if short else (self.responses(c, h, forcing), ())
        position, velocity = self.code.relative_flow(c, x_r, gap, v_r, *angle, *response)
        if c.drift == 0:
            return position, velocity
        if short:
            change = self.code.drift_short(c, x_r, gap, v_r, margin, *angle, h, *rest)
        else:
            change = self.code.drift_long(c, v_r, velocity, *angle, h, *forcing[1:])
        if not advance:
            return position, velocity, *change
        lag = self.integrals(c, h, forcing)[:1]
        gained = self.code.capsule_advance(c, v_r, v_c, position, *angle, h, *forcing[2:], *lag)
        return position, velocity, *change, *gained

    @np.errstate(under="ignore")
    def jacobian(self, c: Any, start: Start, h: Any) -> list[Values]:
        """Derivatives of (x_r, v_r), in drift also of v_c and of x_c's advance, at h, row by row.

        Columns as in JACOBIAN_COLUMNS.
        """
        x_r, gap, v_r, v_c, _, *angle = start
        forcing = self.forcing(c, h)
        integrals = self.integrals(c, h, forcing)
        response, slopes = self.with_slopes(c, h, forcing, integrals)
        if c.drift == 0:
            flat = self.code.jacobian_stick(c, x_r, gap, v_r, *angle, *response, *slopes)
        else:
            known = *response, *forcing, *integrals, *slopes
            flat = self.code.jacobian_drift(c, x_r, gap, v_r, v_c, *angle, h, *known)
        width = len(self.JACOBIAN_COLUMNS)
        return [flat[i : i + width] for i in range(0, len(flat), width)]

    def _rates(self, known: dict[str, Any]) -> Values:
        """Constants q, nu, slow, fast and rate, from those of the equations of motion."""
        sigma, K, by = known["sigma"], known["K"], self.by
        q = K - sigma * sigma
        # If q = 0, sin(nu h)/nu is h to the last digit.
        nu = by.sqrt(max(abs(q), by.ldexp(1, -4 * by.prec)))
        fast = sigma + nu if q < 0 else by.sqrt(K)
        return q, nu, -K / (sigma + nu), fast, fast

    def forcing(self, c: Any, h: Any) -> Values:
        """Functions of the forcing, of which a constant drive has none."""
        return ()

    def integrals(self, c: Any, h: Any, forcing: Values) -> Values:
        """Integrals of the forcing, of which a constant drive has none."""
        return ()

    def free_terms(self, c: Any, h: Any) -> Terms:
        """Terms Gd^(n) h^n / n! of the power series."""
        a, b = 2 * c.sigma * h, c.K * h * h
        d = [1.0 + 0 * h, -a]
        for n in range(2, self.terms):
            d.append(-(a * d[n - 1] + b * d[n - 2] / (n - 1)) / n)
        return d

    def slope_terms(self, c: Any, h: Any, d: Terms) -> Terms:
        """Terms of the power series of G2d."""
        a, b, hh = 2 * c.sigma * h, c.K * h * h, h * h
        z = [0 * h, 0 * h]
        for n in range(2, len(d)):
            z.append((hh * d[n - 2] / (n - 1) - a * z[n - 1] - b * z[n - 2] / (n - 1)) / n)
        return z

    def series(self, c: Any, h: Any) -> Values:
        """G, Gd, H and H1 by their power series in h."""
        return _free_sums(self.free_terms(c, h), h)

    def sensitivity_series(self, c: Any, h: Any) -> Values:
        """G2, G2d and H2 by their power series in h."""
        return _slope_sums(self.slope_terms(c, h, self.free_terms(c, h)), h)

    def halvings(self, reach: Any) -> int:
        """Number of halvings that take `reach`, a rate times a duration, to 1 or less."""
        n = 0
        while reach > 1:
            reach, n = reach / 2, n + 1
        return n

    def short(self, c: Any, h: Any) -> tuple[Values, Values]:
        """Response functions for a short duration, and those that v_c needs."""
        G, Gd, H, H1 = self.series(c, h)
        return (G, Gd, H), (H, H1)

    def free(self, c: Any, h: Any) -> Values:
        """G, Gd and H by series or closed forms."""
        if c.fast * h < 1:
            return self.series(c, h)[:3]
        closed: Values = (basis.overdamped if c.q < 0 else basis.oscillating)(self.by, c, h)
        return closed

    def responses(self, c: Any, h: Any, forcing: Values) -> Values:
        """Response functions for a duration that is not short."""
        return self.free(c, h)

    def free_slopes(self, c: Any, h: Any, free: Values, near: bool) -> Values:
        """G2, G2d and H2 by closed forms, or by doubling if `near`, where these cancel."""
        if not near:
            apart: Values = basis.free_slopes_apart(c, h, *free)
            return apart
        doublings = self.halvings(c.fast * h)
        G, Gd, H = self.series(c, h / 2**doublings)[:3]
        slopes = self.sensitivity_series(c, h / 2**doublings)[:3]
        for _ in range(doublings):
            slopes = basis.free_slopes_doubled(c, G, Gd, H, *slopes)
            G, Gd, H = basis.free_doubled(c, G, Gd, H)
        return slopes

    def with_slopes(
        self, c: Any, h: Any, forcing: Values, integrals: Values
    ) -> tuple[Values, Values]:
        """Response functions and their sensitivities.

        Closed sensitivities cancel more, by a power of the duration: they are used later, and never
        if the spring is overdamped, where K may be small compared with sigma^2.
        """
        free = self.free(c, h)
        near = c.q < 0 or c.rate * h < 8 or abs(c.q) * h * h < 1
        return free, self.free_slopes(c, h, free, near)


class Harmonic(Kernels):
    """Kernels of a scene whose drive is alpha cos(theta)."""

    def _rates(self, known: dict[str, Any]) -> Values:
        """Constants q, nu, slow, Z2, resonant, fast and rate."""
        q, nu, slow, fast, _ = super()._rates(known)
        sigma, K, omega = known["sigma"], known["K"], known["omega"]
        detuning = K - omega * omega
        Z2 = detuning * detuning + 4.0 * sigma * sigma * omega * omega
        total = K + omega * omega
        return q, nu, slow, Z2, total * total > 2.0 * Z2, fast, max(fast, omega)

    def forcing(self, c: Any, h: Any) -> Values:
        """cos(omega h), sin(omega h)/omega and (1 - cos(omega h))/omega^2."""
        cos, sin = self.by.cos, self.by.sin
        half = sin(c.omega * h / 2) / c.omega
        return cos(c.omega * h), sin(c.omega * h) / c.omega, 2 * half * half

    def integrals(self, c: Any, h: Any, forcing: Values) -> Values:
        """Functions lag, sine2, versine2 and lag2 of the forcing."""
        if c.omega * h < 2:  # all four differences below cancel at small angles
            return self.forcing_series((c.omega * h) ** 2, h)
        cosine, sine, versine = forcing
        ww = c.omega * c.omega
        lag, sine2 = (h - sine) / ww, (sine - h * cosine) / (2 * ww)
        return lag, sine2, (versine - h * sine / 2) / ww, (lag - sine2) / ww

    def forcing_series(self, power: Any, h: Any) -> Values:
        """Functions lag, sine2, versine2 and lag2 by power series; `power` is (omega h)^2."""
        term = h * h * h / 6
        lag = sine2 = term
        versine2 = term * h / 4
        lag2 = versine2 * h / 5
        for n in range(1, self.terms):
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

    def series(self, c: Any, h: Any) -> Values:
        """G, Gd, H, H1, B, Bd, Bdd and BI by their power series in h."""
        d = self.free_terms(c, h)
        Bdd, Bd, B, BI = _sums(self.forced_terms(c, h, d))
        hh = h * h
        return *_free_sums(d, h), hh * B, h * Bd, Bdd, hh * h * BI

    def sensitivity_series(self, c: Any, h: Any) -> Values:
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

    def short(self, c: Any, h: Any) -> tuple[Values, Values]:
        """Response functions for a short duration, and those that v_c needs."""
        G, Gd, H, H1, B, Bd, Bdd, BI = self.series(c, h)
        return (G, Gd, H, B, Bd, Bdd), (H, H1, B, Bd, BI)

    def responses(self, c: Any, h: Any, forcing: Values) -> Values:
        """Response functions for a duration that is not short, by doubling near resonance."""
        if c.resonant:
            return self.doubled(c, h, False)[0]
        free = self.free(c, h)
        return *free, *basis.detached(c, *free, *forcing)

    def doubled(self, c: Any, h: Any, sensitive: bool) -> tuple[Values, Values]:
        """Response functions, and all sensitivities on request, from series at a part of h."""
        doublings = self.halvings(c.rate * h)
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

    def with_slopes(
        self, c: Any, h: Any, forcing: Values, integrals: Values
    ) -> tuple[Values, Values]:
        """Response functions and sensitivities, near critical damping the free ones by doubling."""
        strong = c.q < 0 and c.omega < c.fast  # as for a constant drive
        if c.resonant or strong or c.rate * h < 8:
            return self.doubled(c, h, True)
        G, Gd, H, *forced = response = self.responses(c, h, forcing)
        free = self.free_slopes(c, h, (G, Gd, H), abs(c.q) * h * h < 1)
        known = G, *forced, *forcing[:2], integrals[1], *free[:2]
        return response, (*free, *basis.forced_slopes_apart(c, h, *known))


@cache
def _terms(bits: int) -> int:
    """Terms of a series up to those that numbers of these bits do not see."""
    return next(n + 2 for n in count(8) if (n + 1) << (bits - 1) <= math.factorial(n))


def _sums(terms: Terms) -> Values:
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


def _free_sums(d: Terms, h: Any) -> Values:
    Gd, G, H, H1 = _sums(d)
    hh = h * h
    return h * G, Gd, hh * H, hh * h * H1


def _slope_sums(z: Terms, h: Any) -> Values:
    G2d, G2, H2, _ = _sums(z)
    return h * G2, G2d, h * h * H2
