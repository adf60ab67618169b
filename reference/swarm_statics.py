"""What never moves, in a structure of its own: planes in a list, spheres and boxes in a grid that is built once.

Two statics are never paired (documents, rule R2): only a movable body ever looks here.
"""

from __future__ import annotations

import math
from itertools import product
from typing import NamedTuple

import numpy as np
from impactbench.reference.compiled import compiled
from impactbench.reference.particles import BOX, HALF_SPACE, Indices
from impactbench.scenarios.trajectory import Floats

Gap = tuple[float, float, float, float]

REACH = 3.0
"""How far from a static a body's centre is still told of it, in radii of the largest body: enough for a skin of two
diameters."""


class Statics(NamedTuple):
    """kind, place [m] and size [s, 3]: radius, half extents, or a plane's normal, in the modelled axes.

    planes: numbers of the planes; solids: of the others. They stand in every cell that their box, widened by
    `reach` [m], meets: cell c holds item[start[c] : start[c + 1]]. Cells cut the box of all from origin on, `number`
    along each axis, 1 / `inverse` [m] wide; what lies outside counts to the cells at the edge.
    """

    kind: Indices
    place: Floats
    size: Floats
    planes: Indices
    solids: Indices
    reach: float
    origin: Floats
    inverse: Floats
    number: Indices
    start: Indices
    item: Indices


def build_statics(kind: Indices, place: Floats, size: Floats, radius: float, d: int) -> Statics:
    """radius [m]: of the largest movable body."""
    solid = np.flatnonzero(kind != HALF_SPACE)
    reach = REACH * radius
    number, origin, side = np.ones(3, dtype=np.int64), np.zeros(3), np.ones(3)
    if len(solid):
        low, high = place[solid] - size[solid] - reach, place[solid] + size[solid] + reach
        origin, extent = low.min(axis=0), np.ptp(np.concatenate([low, high]), axis=0)
        wanted = float((high - low)[:, :d].max(axis=1).mean())
        share = np.maximum(extent[:d] / wanted, 1.0)
        share *= min(1.0, (4 * len(solid) / share.prod()) ** (1 / d))
        number[:d] = np.maximum(share.astype(np.int64), 1)
        side = np.where(extent > 0, extent, 1.0) / number
    table: list[list[int]] = [[] for _ in range(int(number.prod()))]
    for s in solid:
        widened = size[s] + reach * (1 + 1e-9)
        a, b = (_cell(point, origin, 1 / side, number) for point in (place[s] - widened, place[s] + widened))
        for z, y, x in product(*(range(a[k], b[k] + 1) for k in (2, 1, 0))):
            table[(z * number[1] + y) * number[0] + x].append(int(s))
    return Statics(
        kind=kind,
        place=place,
        size=size,
        planes=np.flatnonzero(kind == HALF_SPACE).astype(np.int64),
        solids=solid.astype(np.int64),
        reach=reach,
        origin=origin,
        inverse=1 / side,
        number=number,
        start=np.concatenate([[0], np.cumsum([len(row) for row in table])]).astype(np.int64),
        item=np.array([s for row in table for s in row], dtype=np.int64),
    )


def _cell(point: Floats, origin: Floats, inverse: Floats, number: Indices) -> Indices:
    return np.clip(np.floor((point - origin) * inverse), 0, number - 1).astype(np.int64)


@compiled
def gap_to_static(
    d: int, kind: int, place: Floats, size: Floats, s: int, x: float, y: float, z: float, r: float
) -> Gap:
    """Gap [m] between static s and a sphere of radius r at (x, y, z), and the unit normal from the static to it."""
    a, b, c = size[s, 0], size[s, 1], size[s, 2]
    x, y, z = x - place[s, 0], y - place[s, 1], z - place[s, 2]
    if kind == HALF_SPACE:
        return x * a + y * b + z * c - r, a, b, c
    reach = r + a
    if kind == BOX:
        if abs(x) <= a and abs(y) <= b and abs(z) <= c:
            return out_of_box(d, x, y, z, a, b, c, r)
        x, y, z, reach = x - max(-a, min(a, x)), y - max(-b, min(b, y)), z - max(-c, min(c, z)), r
    distance = math.sqrt(x * x + y * y + z * z)
    if distance == 0:
        return -reach, 1.0, 0.0, 0.0
    return distance - reach, x / distance, y / distance, z / distance


@compiled
def out_of_box(d: int, x: float, y: float, z: float, a: float, b: float, c: float, r: float) -> Gap:
    """A centre inside the box leaves by the nearest face."""
    deep_x, deep_y, deep_z = abs(x) - a, abs(y) - b if d > 1 else -math.inf, abs(z) - c if d > 2 else -math.inf
    if deep_x >= deep_y and deep_x >= deep_z:
        return deep_x - r, 1.0 if x >= 0 else -1.0, 0.0, 0.0
    if deep_y >= deep_z:
        return deep_y - r, 0.0, 1.0 if y >= 0 else -1.0, 0.0
    return deep_z - r, 0.0, 0.0, 1.0 if z >= 0 else -1.0
