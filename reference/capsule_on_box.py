"""Balls and capsules on a box: the nearest points of the ball's centre, or of the capsule's line, and the box.

A line is nearest to a box at one of its ends or at an edge. So a capsule that lies on a face has a feature at each end,
one that sticks out over an edge has one there.
"""

from __future__ import annotations

import math

from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.features import Features, note
from impactbench.reference.segments import nearest
from impactbench.reference.solids import CAPSULE, SPACE, Solids
from impactbench.reference.triples import apply, back, length, plus, row, rows, scale, subtract, unit
from impactbench.scenarios.records import Vector

INNER = 1e-9
"""Shares of the line this close to an end are the end's; ways this little askew still lead out of a face."""


@inlined
def core(solids: Solids, i: int) -> tuple[Vector, Vector]:
    """One end of a capsule's line and the way to the other; a ball's centre and no way."""
    half = solids.size[i, 1] if solids.kind[i] == CAPSULE else 0.0
    axes = rows(solids.axes, i)
    along = (axes[0][2], axes[1][2], axes[2][2])
    return plus(row(solids.position, i), -half, along), scale(2 * half, along)


@inlined
def extents(solids: Solids, box: int) -> Vector:
    """Half extents; without end along the own axis a planar scene does not see."""
    a, b, c = row(solids.size, box)
    across = across_plane(solids, box)
    return (math.inf if across == 0 else a, math.inf if across == 1 else b, math.inf if across == 2 else c)


@inlined
def across_plane(solids: Solids, box: int) -> int:
    """The own axis of a box that a planar scene looks along, -1 if none."""
    if solids.plane != SPACE:
        for k in range(3):
            if abs(solids.axes[box, solids.plane, k]) > 1 - 1e-12:
                return k
    return -1


@compiled
def ball_on_box(solids: Solids, box: int, centre: Vector, radius: float, found: Features, f: int) -> None:
    """Feature f: from the box's nearest point; for a centre inside, its nearest face."""
    half, axes = extents(solids, box), rows(solids.axes, box)
    own = back(axes, subtract(centre, row(solids.position, box)))
    out = (outside(own[0], half[0]), outside(own[1], half[1]), outside(own[2], half[2]))
    distance = length(out)
    if distance > 0:
        gap, normal = distance - radius, scale(1 / distance, out)
    else:
        face = 0
        for k in range(1, 3):
            if half[k] - abs(own[k]) < half[face] - abs(own[face]):
                face = k
        sign = math.copysign(1.0, own[face])
        gap = abs(own[face]) - half[face] - radius
        normal = scale(sign, unit(face))
    normal = apply(axes, normal)
    note(found, f, f, gap, normal, plus(centre, -radius - gap / 2, normal))


@inlined
def outside(x: float, half: float) -> float:
    """How far x lies beyond [-half, half], signed."""
    return x - max(-half, min(half, x))


@compiled
def capsule_on_box(solids: Solids, box: int, capsule: int, found: Features) -> int:
    """Ends 0 and 1, then each edge that is nearest to the line between them; number 2 + 4 axis + side."""
    start, along = core(solids, capsule)
    radius = solids.size[capsule, 0]
    ball_on_box(solids, box, start, radius, found, 0)
    ball_on_box(solids, box, plus(start, 1.0, along), radius, found, 1)
    count, across, axes = 2, across_plane(solids, box), rows(solids.axes, box)
    start, along = back(axes, subtract(start, row(solids.position, box))), back(axes, along)
    for axis in range(3):
        for side in range(4):
            if across in (-1, axis):
                s, foot, out = to_edge(row(solids.size, box), axis, side, start, along)
                distance = length(out)
                if INNER < s < 1 - INNER and distance > 0:
                    gap, normal = distance - radius, apply(axes, scale(1 / distance, out))
                    point = plus(row(solids.position, box), 1.0, apply(axes, foot))
                    note(found, count, 2 + 4 * axis + side, gap, normal, plus(point, gap / 2, normal))
                    count += 1
    return count


@inlined
def to_edge(half: Vector, axis: int, side: int, start: Vector, along: Vector) -> tuple[float, Vector, Vector]:
    """Where the line is nearest to an edge, in own axes: its share s, the edge's point, the way from there to the line.

    s is -1 where that way does not lead out of both faces: then a face is nearer than their edge.
    """
    first, second = 1.0 if side % 2 else -1.0, 1.0 if side // 2 else -1.0
    x = half[0] * (-1.0 if axis == 0 else first)
    y = half[1] * (-1.0 if axis == 1 else (first if axis == 0 else second))
    z = half[2] * (-1.0 if axis == 2 else second)
    way = scale(2 * half[axis], unit(axis))
    s, t = nearest(start, along, (x, y, z), way)
    foot = plus((x, y, z), t, way)
    out = subtract(plus(start, s, along), foot)
    none = -INNER * length(out)
    leads_x = axis == 0 or math.copysign(1.0, x) * out[0] >= none
    leads_y = axis == 1 or math.copysign(1.0, y) * out[1] >= none
    leads = leads_x and leads_y and (axis == 2 or math.copysign(1.0, z) * out[2] >= none)
    return (s if leads else -1.0), foot, out
