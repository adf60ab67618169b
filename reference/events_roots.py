"""Contact times in closed form: when a gap closes next, from now on (event-driven dynamics: Alder & Wainwright 1959).

Two free spheres feel the same gravity, so their relative motion is linear: a quadratic in t. A sphere and a plane
under gravity: a quadratic. Where accelerations differ (one body rests): a quartic, bracketed between its extrema.
All times [s] are counted from now; `math.inf` means never.
"""

from __future__ import annotations

import math

from impactbench.reference.compiled import compiled, inlined

GRAZING = 1e-18
"""Square of the sine of a grazing approach that is let pass: the overlap it can lead to is below 1e-18 of the
distance."""

HALVINGS = 200


@inlined
def meet(x: float, y: float, z: float, u: float, v: float, w: float, reach: float) -> float:
    """Smaller root of |d + u t| = reach with d = (x, y, z) [m] and relative velocity (u, v, w) [m/s].

    t = c/(-b + sqrt(b^2 - a c)) with a = u.u, b = d.u, c = d.d - reach^2: no cancellation as b < 0.
    """
    b = x * u + y * v + z * w
    if b >= 0.0:
        return math.inf
    a = u * u + v * v + w * w
    square = x * x + y * y + z * z
    c = square - reach * reach
    inside = b * b - a * c
    if inside < 0.0 or b * b <= GRAZING * a * square:
        return math.inf
    return c / (-b + math.sqrt(inside)) if c > 0.0 else 0.0


@inlined
def land(gap: float, speed: float, pull: float) -> float:
    """Time at which gap + speed t + pull t^2/2 falls through 0, in the form that does not cancel.

    A gap closed up to round-off counts as 0. A parabola falls through 0 once at most, so this is the only contact.
    """
    square = speed * speed - 2.0 * pull * gap
    if gap > 0.0 and speed < 0.0:
        return 2.0 * gap / (math.sqrt(square) - speed) if square >= 0.0 else math.inf
    if speed < 0.0:
        return 0.0
    if pull >= 0.0:
        return math.inf
    if gap <= 0.0:
        return -2.0 * speed / pull
    return -(speed + math.sqrt(square)) / pull


@compiled
def fall_back(gap: float, speed: float, pull: float) -> float:
    """Later root of gap + speed t + pull t^2/2 = 0 from behind a face (gap < 0): up through its plane and down."""
    square = speed * speed - 2.0 * pull * gap
    if speed <= 0.0 or pull >= 0.0 or square <= 0.0:
        return math.inf
    return -(speed + math.sqrt(square)) / pull


@compiled
def curve(
    x: float,
    y: float,
    z: float,
    u: float,
    v: float,
    w: float,
    p: float,
    q: float,
    r: float,
    reach: float,
    grain: float,
) -> float:
    """First t >= 0 at which |d + u t + a t^2/2| = reach is passed inwards; a = (p, q, r) [m/s^2] is not 0.

    f = |d + u t + a t^2/2|^2 - reach^2 is a quartic. Between the roots of f' it is monotone, and so is f' between those
    of f'', a quadratic: each bracket holds one root at most. A gap up to `grain` [m] counts as closed.
    """
    square, pull = x * x + y * y + z * z, p * p + q * q + r * r
    speed = u * u + v * v + w * w
    q0, q1 = square - reach * reach, 2.0 * (x * u + y * v + z * w)
    if abs(q0) <= 2.0 * reach * grain:
        q0 = 0.0
    if q1 * q1 <= 4.0 * GRAZING * square * speed:
        q1 = 0.0
    q2, q3, q4 = speed + x * p + y * q + z * r, u * p + v * q + w * r, pull / 4.0
    # Farther on the pull has taken the bodies apart for good.
    end = (math.sqrt(speed) + math.sqrt(speed + 2.0 * math.sqrt(pull) * (math.sqrt(square) + reach))) / math.sqrt(pull)
    low, high = turns(2.0 * q2, 6.0 * q3, 12.0 * q4, end)
    start = 0.0
    for piece in range(3):
        stop = low if piece == 0 else high if piece == 1 else end
        turn = slope_root(q1, q2, q3, q4, start, stop)
        for part in range(2):
            left, right = (start, turn) if part == 0 else (turn, stop)
            after = quartic(q0, q1, q2, q3, q4, right)
            before = quartic(q0, q1, q2, q3, q4, left)
            if right > left and after <= 0.0 and after < before:
                return left if before <= 0.0 else level_root(q0, q1, q2, q3, q4, left, right)
        start = stop
    return math.inf


@compiled
def turns(c: float, b: float, a: float, end: float) -> tuple[float, float]:
    """Roots of c + b t + a t^2 (a > 0) in ascending order, each brought into [0, end]."""
    inside = b * b - 4.0 * a * c
    if inside <= 0.0:
        return 0.0, 0.0
    larger = -(b + math.copysign(math.sqrt(inside), b)) / 2.0
    one, other = larger / a, c / larger
    return min(end, max(0.0, min(one, other))), min(end, max(0.0, max(one, other)))


@compiled
def quartic(q0: float, q1: float, q2: float, q3: float, q4: float, t: float) -> float:
    return q0 + t * (q1 + t * (q2 + t * (q3 + t * q4)))


@compiled
def slope_root(q1: float, q2: float, q3: float, q4: float, left: float, right: float) -> float:
    """Where the quartic's slope changes sign in a bracket in which the slope is monotone; `right` if nowhere."""
    rising = q1 + left * (2.0 * q2 + left * (3.0 * q3 + left * 4.0 * q4)) > 0.0
    if (q1 + right * (2.0 * q2 + right * (3.0 * q3 + right * 4.0 * q4)) > 0.0) == rising:
        return right
    for _ in range(HALVINGS):
        middle = (left + right) / 2.0
        if middle <= left or middle >= right:
            break
        if (q1 + middle * (2.0 * q2 + middle * (3.0 * q3 + middle * 4.0 * q4)) > 0.0) == rising:
            left = middle
        else:
            right = middle
    return left


@compiled
def level_root(q0: float, q1: float, q2: float, q3: float, q4: float, left: float, right: float) -> float:
    """Root of the quartic in a bracket where it falls from above 0 to 0 or below: the side that is still apart."""
    for _ in range(HALVINGS):
        middle = (left + right) / 2.0
        if middle <= left or middle >= right:
            break
        if quartic(q0, q1, q2, q3, q4, middle) > 0.0:
            left = middle
        else:
            right = middle
    return left
