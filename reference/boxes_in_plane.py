"""Boxes on boxes in a plane: two four-cornered outlines.

The face that parts them most (separating axes; Gottschalk, Lin & Manocha 1996) gives the normal; the other box's face
that looks at it, cut to its width, gives the two points (as in box2d-lite). The smaller gap is positive exactly where
the boxes are apart: it is their distance, or less where corner faces corner; of an overlap it is the least way out.

A point is known by the corner it lies at, A's 0 to 3 or B's 4 to 7, whichever box holds the parting face: so a
contact stays the same one while a box rocks on its corner. Where two corners coincide (equal boxes in a column) it is
A's.
"""

from __future__ import annotations

import math

from impactbench.reference.capsule_on_box import across_plane
from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.features import Features, note
from impactbench.reference.solids import Solids
from impactbench.scenarios.records import Vector

SAME = 1e-9
"""Corners this close, next to the face, coincide."""

Outline = tuple[float, float, float, float, float, float, float, float]
"""Centre x, y; first own axis x, y; second own axis x, y; half extents along them. In the plane's coordinates."""


@compiled
def boxes_in_plane(solids: Solids, a: int, b: int, found: Features) -> int:
    """Write the features of boxes a and b into `found`; returns their number, 1 or 2."""
    of_a, of_b = outline(solids, a), outline(solids, b)
    parted_a, face_a = parting_face(of_a, of_b)
    parted_b, face_b = parting_face(of_b, of_a)
    if parted_a >= parted_b:
        return cut(solids, a, of_a, of_b, face_a, parted_a, True, found)
    return cut(solids, a, of_b, of_a, face_b, parted_b, False, found)


@inlined
def outline(solids: Solids, i: int) -> Outline:
    u, v, across = (solids.plane + 1) % 3, (solids.plane + 2) % 3, across_plane(solids, i)
    first, second = (across + 1) % 3, (across + 2) % 3
    x, axes, size = solids.position, solids.axes, solids.size
    return (
        x[i, u],
        x[i, v],
        axes[i, u, first],
        axes[i, v, first],
        axes[i, u, second],
        axes[i, v, second],
        size[i, first],
        size[i, second],
    )


@inlined
def parting_face(box: Outline, other: Outline) -> tuple[float, int]:
    """The face of `box` with the most room [m] to all of `other` (negative: the least depth), and that room.

    Faces 0 to 3 look along +first, +second, -first, -second axis; face k lies between corners k - 1 and k.
    """
    x, y = other[0] - box[0], other[1] - box[1]
    room, face = -math.inf, 0
    for k in range(2):
        n_x, n_y, half = (box[2], box[3], box[6]) if k == 0 else (box[4], box[5], box[7])
        along = x * n_x + y * n_y
        reach = abs(n_x * other[2] + n_y * other[3]) * other[6] + abs(n_x * other[4] + n_y * other[5]) * other[7]
        if abs(along) - half - reach > room:
            room, face = abs(along) - half - reach, k if along >= 0 else k + 2
    return room, face


@inlined
def face_normal(box: Outline, face: int) -> tuple[float, float]:
    """Outward, of length 1."""
    sign = 1.0 if face < 2 else -1.0
    return (sign * box[2], sign * box[3]) if face % 2 == 0 else (sign * box[4], sign * box[5])


@inlined
def corner(box: Outline, k: int) -> tuple[float, float]:
    """Corner k, seen from the centre; 0 is ahead on both axes, then round to 3, ahead on the first alone."""
    first = box[6] if k in (0, 3) else -box[6]
    second = box[7] if k < 2 else -box[7]
    return first * box[2] + second * box[4], first * box[3] + second * box[5]


@compiled
def cut(
    solids: Solids, a: int, box: Outline, other: Outline, face: int, room: float, mine: bool, found: Features
) -> int:
    """The face of `other` that looks at `face` of `box`, cut to its width. `mine`: `box` is A."""
    n_x, n_y = face_normal(box, face)
    facing = 0
    for k in range(1, 4):
        m, best = face_normal(other, k), face_normal(other, facing)
        if m[0] * n_x + m[1] * n_y < best[0] * n_x + best[1] * n_y:
            facing = k
    depth, width = (box[6], box[7]) if face % 2 == 0 else (box[7], box[6])
    low, s_low, g_low = seen(box, other, (facing + 3) % 4, n_x, n_y, depth)
    high, s_high, g_high = seen(box, other, facing, n_x, n_y, depth)
    if s_low > s_high:
        low, s_low, g_low, high, s_high, g_high = high, s_high, g_high, low, s_low, g_low
    if s_low > width or s_high < -width:  # corner faces corner
        number, along = (low, s_low) if g_low <= g_high else (high, s_high)
        write(solids, a, box, n_x, n_y, along, depth, room, number + (4 if mine else 0), mine, found, 0)
        return 1
    slope = (g_high - g_low) / (s_high - s_low)
    for end in range(2):
        number, along, gap = (low, s_low, g_low) if end == 0 else (high, s_high, g_high)
        number += 4 if mine else 0
        beyond = abs(along) - width if (along > 0) == (end == 1) else -width
        own = end_corner(box, face, n_x, n_y, end) + (0 if mine else 4)
        if beyond > SAME * width:
            gap -= slope * math.copysign(beyond, along)
            along, number = math.copysign(width, along), own
        elif beyond >= -SAME * width and mine:
            number = own
        write(solids, a, box, n_x, n_y, along, depth, gap, number, mine, found, end)
    return 2


@inlined
def seen(box: Outline, other: Outline, k: int, n_x: float, n_y: float, depth: float) -> tuple[int, float, float]:
    """Corner k of `other`: its number, place along the face from its middle [m], and gap [m]."""
    c = corner(other, k)
    x, y = other[0] + c[0] - box[0], other[1] + c[1] - box[1]
    return k, y * n_x - x * n_y, x * n_x + y * n_y - depth


@inlined
def end_corner(box: Outline, face: int, n_x: float, n_y: float, end: int) -> int:
    """The corner at the low (0) or high (1) end of a face."""
    c = corner(box, face)
    return face if (c[1] * n_x - c[0] * n_y > 0) == (end == 1) else (face + 3) % 4


@inlined
def write(
    solids: Solids,
    a: int,
    box: Outline,
    n_x: float,
    n_y: float,
    along: float,
    depth: float,
    gap: float,
    number: int,
    mine: bool,
    found: Features,
    f: int,
) -> None:
    """Feature f, back in space: in the plane of A, midway between the surfaces."""
    away = depth + gap / 2
    x, y = box[0] + away * n_x - along * n_y, box[1] + away * n_y + along * n_x
    sign = 1.0 if mine else -1.0
    normal = in_space(solids.plane, 0.0, sign * n_x, sign * n_y)
    note(found, f, number, gap, normal, in_space(solids.plane, solids.position[a, solids.plane], x, y))


@inlined
def in_space(plane: int, across: float, x: float, y: float) -> Vector:
    """From the plane's coordinates, which follow its axis in cyclic order."""
    if plane == 0:
        return (across, x, y)
    return (y, across, x) if plane == 1 else (x, y, across)
