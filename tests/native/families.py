"""Starts of expansions that show what each term of the certificate is for."""

import math
from collections.abc import Callable
from dataclasses import replace
from random import Random

from capsule_sym import Parameters
from tests.native.certificate import WIDTHS, Start, Truth, mp, mpf

Ordered = tuple[tuple[float, float, float], ...]
# alpha, omega, zeta, beta, gamma, f_b (delta is 0); x_r, v_r at rest, phase
ORDERED: list[Ordered] = [
    (
        (2.3837827716870166, 1.0690716566096392, 0.3082677339729205),
        (0.9891951494972765, 4.942143517142021, 0.05416355459881703),
        (-0.02096709732463163, -0.011608767544829108, 1.1685358814730318),
    ),
    (
        (1.0920262664902491, 1.2006372326031984, 0.3256947501430873),
        (1.7464861081931033, 1.4706432112019958, 0.06240025762064204),
        (-0.029281921560665457, 0.040629844749590714, 0.9762053397573378),
    ),
    (
        (2.9061109533748755, 0.8678388032148538, 0.5628869736731561),
        (0.34613253808203426, 5.470109283036071, 0.06276324435884041),
        (-0.006330451848614541, -0.04389248398030901, 1.5158942297580225),
    ),
    (
        (1.4948031519179055, 0.9706343786048014, 0.5142225889774076),
        (2.9233641566496713, 5.46900586323855, 0.034748153255739184),
        (-0.003724053656182954, -0.02052128124669291, 1.3280098703996766),
    ),
]

WAY = {1: 1, 2: 0, 3: -1, 4: 1, 5: 0, 6: -1}


def _log(random: Random, low: float, high: float) -> float:
    return math.exp(random.uniform(math.log(low), math.log(high)))


def _parameters(random: Random) -> Parameters:
    return Parameters(
        alpha=_log(random, 1e-2, 1e1),
        omega=_log(random, 1e-1, 1e1),
        delta=_log(random, 1e-3, 3.0),
        zeta=_log(random, 1e-3, 3.0),
        beta=_log(random, 1e-1, 1e2),
        gamma=_log(random, 1e-1, 3e1),
    )


def moving(random: Random) -> Start:
    """Anywhere, on the impact surface, at the start of a slip, or where P is +-f_b."""
    p, field = _parameters(random), random.randint(1, 6)
    way, side = WAY[field], 1 if field > 3 else -1
    on_gap = random.random() < 0.4
    x_r = p.delta if on_gap else p.delta + side * abs(random.gauss(0, 1))
    v_r = side * abs(random.gauss(0, 1)) if on_gap else random.gauss(0, 1)
    v_c, second = way * abs(random.gauss(0, 1)), 0
    if way and random.random() < 0.5:
        v_c, second = 0.0, random.choice((1, 2))
    elif not way and random.random() < 0.4:
        second = random.choice((1, -1))
    if second == 2 or (not way and second):
        pull = way if way else second
        spring = p.beta * (x_r - p.delta) if field > 3 else 0.0
        v_r = (pull * p.f_b - x_r - spring) / (2 * p.zeta)
        if abs(v_r) > 1e2 or (on_gap and v_r * side < 0):
            return moving(random)
    angle = random.uniform(0, 2 * math.pi)
    return Start(p, field, (x_r, v_r, v_c), angle, zeros=(int(on_gap), second))


def shorter(random: Random) -> Start:
    """The same, on an expansion half as long or less, where no closed form gives its end."""
    return replace(moving(random), level=random.choice((1, 2)))


def still(random: Random) -> Start:
    """Hardly a motion far from the impact surface: all that is rounded is the gap, or f_b -+ P."""
    delta, tiny = random.uniform(1.0, 2.0), 1e-6
    p = Parameters(tiny, 1.0, delta, 0.05, 1.5, 3.3)
    return Start(p, 2, (tiny * random.random(), tiny * random.random(), 0.0), random.uniform(0, 6))


def heavy(random: Random) -> Start:
    """A heavy capsule begins to drift: its acceleration is all that is rounded."""
    p = Parameters(1e-6, 1.0, 1e-9, 0.05, 1.5, random.uniform(1e3, 2e3))
    x_r = -0.1 * random.random()
    return Start(p, 1, (x_r, 0.0, 0.0), random.uniform(0, 6), zeros=(0, 1))


def fast(random: Random) -> Start:
    """A capsule that drifts fast."""
    p = _parameters(random).replace(gamma=30.0)
    return Start(
        p, 1, (-1e-3 * random.random(), 0.0, random.uniform(1e4, 2e4)), random.uniform(0, 6)
    )


def overdamped(random: Random) -> Start:
    """So damped that an expansion is short: the sum of x_r is all that is rounded."""
    x_r = random.uniform(0.5, 0.9)
    p = Parameters(0.0, 1.0, x_r + 1e-9, random.uniform(1e5, 1e6), 1.5, 3.3)
    return Start(p, 2, (x_r, 0.0, 0.0), 0.0)


def stopping(random: Random) -> Start:
    """So damped that v_r nearly vanishes at the end: of its terms the roundings stay."""
    p = Parameters(1e-12, 1.0, 1e-9, 1000.0, 1.5, 3.3)
    v_r = -random.uniform(0.2, 2.0) * p.f_b / p.gamma / p.zeta / 2
    return Start(p, 1, (0.0, v_r, 1.0), random.uniform(0, 6))


def displaced(random: Random) -> Start:
    """The true motion is off by as much as the errors that it stands at allow."""
    start = moving(random)
    if start.zeros != (0, 0):
        return displaced(random)
    truth, size = Truth(start), 1e-4
    turn = random.uniform(0, 2 * math.pi)
    x, v = size * math.cos(turn) / math.sqrt(float(truth.K)), size * math.sin(turn)
    v_c = random.choice((-1, 1)) * size if truth.way else 0.0
    shrunk = 1 - 1e-9
    return replace(
        start, errors=(size, size, 0.0), off=(x * shrunk, v * shrunk, v_c * shrunk, 0.0), steps=2
    )


def drift_displaced(random: Random) -> Start:
    """v_c alone is off."""
    start = displaced(random)
    if not WAY[start.field]:
        return drift_displaced(random)
    return replace(start, errors=(0.0, 1e-4, 0.0), off=(0.0, 0.0, start.off[2], 0.0), steps=2)


def energy_displaced(random: Random) -> Start:
    """x_r and v_r alone are off, of a light capsule that drifts."""
    start = displaced(random)
    if not WAY[start.field]:
        return energy_displaced(random)
    p = start.parameters.replace(gamma=0.1, zeta=1e-3)
    start = replace(start, parameters=p)
    K = float(Truth(start).K)
    x, v = random.choice(((1e-4 / math.sqrt(K), 0.0), (0.0, 1e-4), (0.0, -1e-4)))
    v_c = 50.0 * WAY[start.field]
    return replace(
        start, state=(start.state[0], start.state[1], v_c), errors=(1e-4, 0.0, 0.0), steps=3,
        off=(x * (1 - 1e-9), v * (1 - 1e-9), 0.0, 0.0),
    )  # fmt: skip


def out_of_phase(random: Random) -> Start:
    """The forcing's angle is off, near resonance: its work adds up over the expansions."""
    p = Parameters(0.3, 1.001, 50.0, 1e-3, 1.5, 3.3, 100.0)
    angle, off = random.uniform(0, 6), 1e-6
    start = Start(p, 2, (0.1, 0.0, 0.0), angle)
    reach = 1.4
    return replace(
        start, errors=(off * p.alpha * reach, 0.0, off), off=(0, 0, 0, off * (1 - 1e-9)), steps=12
    )


def dipping(random: Random) -> Start:
    """The gap turns within a remainder of zero on the way."""
    return _turning(random, 3.0, -9.0, -4.0)


def twice(random: Random) -> Start:
    """The gap is past zero for a moment, late on an expansion half as long or less."""
    p, field, level = _parameters(random), random.choice((1, 4)), random.choice((1, 2))
    side, past = 1 if field > 3 else -1, 10.0 ** random.uniform(-4, -3)
    target, angle = (p.delta - side * past, 0.0, 5.0), random.uniform(0, 2 * math.pi)
    t = random.uniform(0.6, 0.9) * 3.0 / 2**level / growth(p, field)
    start = before(p, field, target, angle, t)
    turns = side * Truth(Start(p, field, target, angle)).rate > 0
    if not turns or p.zeta > 0.5 or p.omega > 1 or min(Truth(start).guards(mpf(0))) <= 0:
        return twice(random)
    return replace(start, level=level)


def dipping_wide(random: Random) -> Start:
    """So it does on the expansions of 106 bits, whose remainders are smaller."""
    return _turning(random, 6.0, -13.0, -9.0)


def _turning(random: Random, reach: float, least: float, most: float) -> Start:
    p, field = _parameters(random), random.choice((1, 2, 4, 5))
    if not 0.3 < p.omega < 3:
        return _turning(random, reach, least, most)
    size = random.choice((0.0, 10.0 ** random.uniform(least, most)))
    gap, angle = random.choice((-1, 1)) * size, random.uniform(0, 2 * math.pi)
    t = random.uniform(0.3, 0.9) * reach / _rate(p, field)
    return before(p, field, (p.delta + gap, 0.0, 5.0 * WAY[field]), angle, t)


def ending(random: Random) -> Start:
    """The gap is past zero at the expansion's end, by less than a remainder."""
    return _passing(random, 3.0, -10.0, -6.0)


def ending_wide(random: Random) -> Start:
    """So it is on the expansions of 106 bits."""
    return _passing(random, 6.0, -14.0, -10.0)


def _passing(random: Random, reach: float, least: float, most: float) -> Start:
    p, field = _parameters(random), random.choice((1, 2, 4, 5))
    p = p.replace(zeta=0.05, omega=random.uniform(0.3, 1.0), beta=random.uniform(0.1, 3.0))
    side, past = (1 if field > 3 else -1), 10.0 ** random.uniform(least, most)
    target = (p.delta - side * past, -side * random.uniform(0.2, 1.0), 5.0 * WAY[field])
    return before(p, field, target, random.uniform(0, 2 * math.pi), reach / growth(p, field))


def late(random: Random) -> Start:
    """P passes f_b, or x_r delta, late on a long expansion, where remainders are largest."""
    p = _parameters(random).replace(zeta=0.02, omega=random.uniform(0.3, 1.0), alpha=1.0)
    x_r, v_r, angle = random.gauss(0, 1), random.uniform(0.5, 2), random.uniform(0, 2 * math.pi)
    t = 0.97 * 4.5 / growth(p, 2)
    if random.random() < 0.5:
        p = p.replace(delta=x_r) if x_r > 0 else p.replace(delta=-x_r)
        return before(p.replace(f_b=50.0), 2, (p.delta, v_r, 0.0), angle, t)
    pull = abs(x_r + 2 * p.zeta * v_r)
    return before(p.replace(delta=50.0, f_b=pull), 2, (x_r, v_r, 0.0), angle, t)


def creeping(random: Random) -> Start:
    """Slow forcing carries x_r past delta at the balance of forces far larger than its rate."""
    p = Parameters(1.0, 0.02, random.uniform(0.3, 0.8), 0.05, 1.5, 3.3, 10.0)
    angle = 2 * math.pi - math.acos(p.delta / p.alpha)
    v_r = -p.omega * p.alpha * math.sin(angle)
    return before(p, 2, (p.delta, v_r, 0.0), angle, random.uniform(0.2, 0.9))


def corner(random: Random) -> Start:
    """x_r meets delta and v_c vanishes within an instant of each other."""
    p, field = _parameters(random), random.choice((1, 3))
    apart = random.choice((-1, 1)) * 10.0 ** random.uniform(-12, -8)
    target = (p.delta, random.uniform(0.3, 1.0), apart * WAY[field])
    return before(p, field, target, random.uniform(0, 2 * math.pi), 0.3 / growth(p, field))


def slow_corner(random: Random) -> Start:
    """x_r passes delta so slowly that by its error v_c, falling fast, may vanish before."""
    p, size = _parameters(random), 1e-6
    p = p.replace(alpha=0.5, omega=1.0, delta=random.uniform(0.1, 0.5), zeta=0.05, gamma=0.1)
    falling = (p.f_b - p.delta) / p.gamma
    target = (p.delta, random.uniform(0.04, 0.08), falling * random.uniform(2e-6, 3e-6))
    start = before(p, 1, target, random.uniform(0, 2 * math.pi), 0.01)
    off = -size / math.sqrt(float(Truth(start).K)) * (1 - 1e-9)
    return replace(start, errors=(size, 0.0, 0.0), off=(off, 0.0, 0.0, 0.0))


def stopped(random: Random) -> Start:
    """A drift ends where P is -+f_b within rounding: whether another begins is the question."""
    field = random.choice((1, 3))
    p = Parameters(random.uniform(0.1, 0.5), 1.0, 3.0, 0.2, 1.5, random.uniform(1, 4))
    x_r = random.uniform(-0.5, 0.5)
    v_r = (-WAY[field] - x_r) / (2 * p.zeta)
    target = (x_r, v_r, 0.0)
    return before(p, field, target, random.uniform(0, 2 * math.pi), random.uniform(0.02, 0.1))


def inflected(random: Random) -> Start:
    """The gap levels out within rounding of zero, comes back a little, and crosses."""
    angle, speed = random.uniform(5.1, 6.0), -(10.0 ** random.uniform(-12, -9))
    p = Parameters(1.0, random.uniform(0.8, 1.5), random.uniform(0.2, 1.0), 0.05, 1.5, 3.3, 100.0)
    alpha = (p.delta + 2 * p.zeta * speed) / math.cos(angle)
    p, t = p.replace(alpha=alpha), random.uniform(0.2, 0.9)
    bend = -alpha * p.omega * math.sin(angle) - speed
    past = random.uniform(-1.0, 1.0) * 1e-15
    start = before(p, 2, (p.delta + past, speed, 0.0), angle, t)
    return replace(start, hints=(t - math.sqrt(-2 * speed / bend), t))


def grazed(random: Random) -> Start:
    """The gap dips below zero for an instant, just before v_c vanishes."""
    p, depth = _parameters(random), 10.0 ** random.uniform(-7, -3.5)
    p = p.replace(alpha=random.uniform(1, 3), delta=random.uniform(0.1, 0.7), zeta=0.05, omega=1.0)
    rate, pull = random.uniform(0.3, 1.5), p.delta - (1 + p.beta) * depth
    slowing = (p.f_b - pull) / p.gamma
    if abs(rate + pull - slowing) > p.alpha:
        return grazed(random)
    angle = random.choice((1, -1)) * math.acos((rate + pull - slowing) / p.alpha)
    later = math.sqrt(2 * depth / rate) * random.uniform(1.05, 3.0)
    target = (p.delta - depth, 0.0, slowing * later)
    return before(p, 4, target, angle % (2 * math.pi), random.uniform(0.2, 0.9) / _rate(p, 4))


def hidden(random: Random) -> Start:
    """The gap dips below zero by a fiftieth of what its form is off, and v_c vanishes where it has
    come back by more than the whole of that."""
    p = Parameters(
        alpha=2.2230437880814455, omega=1.9988045949353548, delta=0.11040478522141742,
        zeta=0.17310830388896928, beta=2.4488209009613557, gamma=0.36243071462226384,
        f_b=0.32424312029391716,
    )  # fmt: skip
    x_r = 0.02283193745750612 - 1e-11 * random.random()
    state = (x_r, 0.5208563060020691, 0.2370058336112709)
    return Start(p, 1, state, 3.5117766276250784, hints=(0.4909548251815907,))


def both_bounds(random: Random) -> Start:
    """P rises past f_b, x_r meets delta, P falls past -f_b, all within one expansion."""
    (alpha, omega, zeta), (beta, gamma, f_b), (x_r, v_r, phase) = random.choice(ORDERED)
    p = Parameters(alpha, omega, 0.0, zeta, beta, gamma, f_b)
    return Start(p, 2, (x_r, v_r, 0.0), phase * omega)


def level(random: Random) -> Start:
    """P is +-f_b, and neither rises nor falls there but by a rounding; then it comes back."""
    p = Parameters(1.0, random.uniform(0.5, 2), 9.0, random.uniform(0.1, 0.5), 1.5, 3.3)
    x_r, v_r, angle = random.gauss(0, 1), random.gauss(0, 1), random.uniform(0, 2 * math.pi)
    pull = x_r + 2 * p.zeta * v_r
    p = p.replace(f_b=abs(pull), alpha=abs((pull - v_r / 2 / p.zeta) / math.cos(angle)))
    start = Start(p, 2, (x_r, v_r, 0.0), angle, zeros=(0, 1 if pull > 0 else -1))
    truth, step = Truth(start), mpf(10) ** -20
    rate = truth.pull_rate() * start.zeros[1]
    bend = (truth.moved(step)[1] - truth.moved(-step)[1]) / (2 * step)
    bend = start.zeros[1] * (bend + truth.damp * _second(truth, step))
    if abs(rate) > 1e-14 or bend > -0.1:
        return level(random)
    return replace(start, hints=(float(-rate / bend),) if rate > 0 else ())


def _second(truth: Truth, step: mpf) -> mpf:
    """v_r'' at the start."""
    one, none, other = (truth.moved(k * step)[1] for k in (1, 0, -1))
    return (one - 2 * none + other) / step**2


def tiny(random: Random) -> Start:
    """So small that products are rounded below the normal range."""
    return _scaled(random, 1e-310)


def tiny_wide(random: Random) -> Start:
    """So small that the second halves of 106 bits are."""
    return _scaled(random, 1e-300)


def _scaled(random: Random, scale: float) -> Start:
    start = moving(random)
    if start.zeros != (0, 0):
        return _scaled(random, scale)
    p = start.parameters
    p = p.replace(alpha=p.alpha * scale, delta=p.delta * scale, f_b=p.f_b * scale)
    x_r, v_r, v_c = (value * scale for value in start.state)
    return replace(start, parameters=p, state=(x_r, v_r, v_c))


def growth(p: Parameters, field: int) -> float:
    """Unit of the length of an expansion, of an underdamped flow."""
    truth = Truth(Start(p, field, (0.0, 0.0, 0.0), 0.0))
    return float(mp.sqrt(truth.K) - sum(truth.rates).real)


def _rate(p: Parameters, field: int) -> float:
    truth = Truth(Start(p, field, (0.0, 0.0, 0.0), 0.0))
    return float(max(abs(truth.rates[0]), p.omega))


def before(
    p: Parameters, field: int, state: tuple[float, float, float], angle: float, t: float
) -> Start:
    """The start a time t before a state."""
    earlier = Truth(Start(p, field, state, angle)).before(t)
    return Start(p, field, earlier, (angle - p.omega * t) % (2 * math.pi), hints=(t,))


DOUBLES = ("1", "4", "8")
FAMILIES: dict[str, tuple[Callable[[Random], Start], float, tuple[str, ...]]] = {
    "moving": (moving, 0.0, (*WIDTHS,)),
    "shorter": (shorter, 0.0, DOUBLES),
    "moving on long expansions": (moving, 3.0, (*WIDTHS,)),
    "shorter on long expansions": (shorter, 8.0, DOUBLES),
    "still": (still, 0.0, (*WIDTHS,)),
    "heavy": (heavy, 0.0, (*WIDTHS,)),
    "fast": (fast, 0.0, (*WIDTHS,)),
    "overdamped": (overdamped, 0.0, (*WIDTHS,)),
    "stopping": (stopping, 0.0, (*WIDTHS,)),
    "displaced": (displaced, 0.0, (*WIDTHS,)),
    "drift displaced": (drift_displaced, 0.0, (*WIDTHS,)),
    "energy displaced": (energy_displaced, 0.0, (*WIDTHS,)),
    "out of phase": (out_of_phase, 0.0, (*WIDTHS,)),
    "dipping": (dipping, 3.0, DOUBLES),
    "twice": (twice, 3.0, DOUBLES),
    "dipping wide": (dipping_wide, 12.0, ("106 bits",)),
    "ending": (ending, 3.0, DOUBLES),
    "ending wide": (ending_wide, 12.0, ("106 bits",)),
    "late": (late, 4.5, (*WIDTHS,)),
    "inflected": (inflected, 0.0, DOUBLES),
    "grazed": (grazed, 0.0, (*WIDTHS,)),
    "hidden": (hidden, 0.0, (*WIDTHS,)),
    "both bounds": (both_bounds, 0.0, (*WIDTHS,)),
    "level": (level, 0.0, DOUBLES),
    "tiny": (tiny, 0.0, DOUBLES),
    "tiny, 106 bits": (tiny_wide, 0.0, ("106 bits",)),
    "creeping": (creeping, 0.0, (*WIDTHS,)),
    "slow corner": (slow_corner, 0.0, (*WIDTHS,)),
    "corner": (corner, 0.0, (*WIDTHS,)),
    "stopped": (stopped, 0.0, DOUBLES),
}
"""Families by name: how a start is drawn, the length of expansions (0: the library's own), and the
widths at which they are checked."""
