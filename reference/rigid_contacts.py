"""Where two rigid bodies touch: features with gap [m], unit normal from A to B and point, in world axes.

A feature is what can touch by itself: a ball, an end of a capsule, a corner of a box. Its number lasts, so that a
contact is known again in the next step (documents, rule R3). A negative gap is an overlap.
"""

from __future__ import annotations

from impactbench.reference.boxes_in_plane import boxes_in_plane
from impactbench.reference.capsule_on_box import ball_on_box, capsule_on_box, core
from impactbench.reference.compiled import compiled
from impactbench.reference.features import Features, note
from impactbench.reference.rigid_body import rotation
from impactbench.reference.segments import nearest
from impactbench.reference.solids import BOX, CAPSULE, HALF_SPACE, SPACE, SPHERE, Solids
from impactbench.reference.triples import apply, dot, length, plus, row, rows, scale, subtract
from impactbench.scenarios.engine import Unsupported
from impactbench.scenarios.records import Body, Box


def check_pair(a: Body, b: Body, plane: int) -> None:
    """Raise `Unsupported` for a pair of shapes that has no contact here."""
    boxes = [body for body in (a, b) if isinstance(body.shape, Box)]
    if len(boxes) == 2 and plane == SPACE:
        raise Unsupported(f"bodies {a.name!r} and {b.name!r}: the rigid runner has box on box in a plane only")
    for body in boxes:
        if plane != SPACE and len(boxes) == 2 and abs(rotation(body.orientation)[plane]).max() < 1 - 1e-12:
            raise Unsupported(f"body {body.name!r}: a box on a box in a plane must stand square to it")


@compiled
def find(solids: Solids, a: int, b: int, found: Features) -> int:
    """Write all features of a pair into `found`; returns their number."""
    if solids.kind[a] <= solids.kind[b]:
        return find_ordered(solids, a, b, found)
    count = find_ordered(solids, b, a, found)
    for f in range(count):
        for k in range(3):
            found.normal[f, k] = -found.normal[f, k]
    return count


@compiled
def find_ordered(solids: Solids, a: int, b: int, found: Features) -> int:
    """Those of a pair whose shapes come in the order of `solids`."""
    if solids.kind[a] == HALF_SPACE:
        return on_plane(solids, a, b, found)
    if solids.kind[a] != BOX:
        return rounds(solids, a, b, found)
    if solids.kind[b] == SPHERE:
        ball_on_box(solids, a, row(solids.position, b), solids.size[b, 0], found, 0)
        return 1
    if solids.kind[b] == CAPSULE:
        return capsule_on_box(solids, a, b, found)
    return boxes_in_plane(solids, a, b, found)


@compiled
def on_plane(solids: Solids, a: int, b: int, found: Features) -> int:
    """Half-space A: the body's corners, each lowered by its radius."""
    normal, foot, axes = row(solids.size, a), row(solids.position, a), rows(solids.axes, b)
    radius = 0.0 if solids.kind[b] == BOX else solids.size[b, 0]
    for c in range(solids.corner_count[b]):
        centre = plus(row(solids.position, b), 1.0, apply(axes, row(solids.corners[b], c)))
        gap = dot(subtract(centre, foot), normal) - radius
        note(found, c, c, gap, normal, plus(centre, -radius, normal))
    return int(solids.corner_count[b])


@compiled
def rounds(solids: Solids, a: int, b: int, found: Features) -> int:
    """Spheres and capsules: the nearest points of their cores, the centre or the line within."""
    (p, along_a), (q, along_b) = core(solids, a), core(solids, b)
    s, t = nearest(p, along_a, q, along_b)
    p, q = plus(p, s, along_a), plus(q, t, along_b)
    between = subtract(q, p)
    distance = length(between)
    normal = scale(1 / distance, between) if distance > 0 else (1.0, 0.0, 0.0)
    gap = distance - solids.size[a, 0] - solids.size[b, 0]
    note(found, 0, 0, gap, normal, plus(p, solids.size[a, 0] + gap / 2, normal))
    return 1
