"""Bodies by the cell of their centre, to find who is near a place at a cost that does not grow with their number.

A level for each power of two of the bodies' extents, so that sizes may differ at will; its cells are as wide as its
largest body. Cells stand in a table of buckets by a hash of their numbers, so that space needs no bounds (Teschner et
al. 2003, Optimized spatial hashing for collision detection of deformable objects).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.particles import Indices
from impactbench.scenarios.trajectory import Floats

FAR = 1e12
"""Cells further out than this count as one: taking bodies closer together loses none."""


class Cells(NamedTuple):
    """body, cell [m], [m, 3]: numbers of the bodies and their cells, bucket after bucket; bucket k holds rows start[k]
    to start[k + 1].

    exponent, extent [m], first [levels]: of a level, ascending; its largest body's half width; its first bucket. along:
    1 for the axes that are cut into cells.
    """

    body: Indices
    cell: Indices
    start: Indices
    exponent: Indices
    extent: Floats
    first: Indices
    along: Floats


@compiled
def build_cells(body: Indices, position: Floats, extent: Floats, along: Floats) -> Cells:
    """Cells of the bodies numbered `body`. Of all bodies: position [m] [n, 3], extent [m] [n], half the widest side."""
    powers = np.zeros(len(body), dtype=np.int64)
    for k in range(len(body)):
        powers[k] = exponent_of(extent[body[k]])
    exponent = np.unique(powers)
    level = np.searchsorted(exponent, powers)
    largest, count = np.zeros(len(exponent)), np.zeros(len(exponent), dtype=np.int64)
    for k in range(len(body)):
        largest[level[k]] = max(largest[level[k]], extent[body[k]])
        count[level[k]] += 1
    first = np.zeros(len(exponent) + 1, dtype=np.int64)
    for k in range(len(exponent)):
        first[k + 1] = first[k] + 2 ** exponent_of(count[k])
    start, bucket = np.zeros(first[-1] + 1, dtype=np.int64), np.zeros(len(body), dtype=np.int64)
    rows = Cells(np.zeros_like(body), np.zeros((len(body), 3), dtype=np.int64), start, exponent, largest, first, along)
    for k in range(len(body)):
        x, y, z = cell_of(rows, level[k], position[body[k]], 0.0)
        bucket[k] = bucket_of(rows, level[k], x, y, z)
        start[bucket[k] + 1] += 1
    for b in range(len(start) - 1):
        start[b + 1] += start[b]
    fill = start.copy()
    for k in range(len(body)):
        row = fill[bucket[k]]
        fill[bucket[k]] += 1
        rows.body[row] = body[k]
        rows.cell[row, 0], rows.cell[row, 1], rows.cell[row, 2] = cell_of(rows, level[k], position[body[k]], 0.0)
    return rows


@inlined
def exponent_of(size: float) -> int:
    """The e of the smallest 2^e above `size`."""
    exponent: int = math.frexp(size)[1]
    return exponent


@inlined
def cell_of(cells: Cells, level: int, place: Floats, beside: float) -> tuple[int, int, int]:
    """Numbers of the cell of a place, moved by `beside` [m] along each axis."""
    return (
        column(cells, level, place, beside, 0),
        column(cells, level, place, beside, 1),
        column(cells, level, place, beside, 2),
    )


@inlined
def column(cells: Cells, level: int, place: Floats, beside: float, k: int) -> int:
    if cells.along[k] == 0.0:
        return 0
    width = max(2 * cells.extent[level], 1e-300)
    number: int = math.floor(min(max((place[k] + beside) / width, -FAR), FAR))
    return number


@inlined
def bucket_of(cells: Cells, level: int, x: int, y: int, z: int) -> int:
    mixed = (x * 73856093) ^ (y * 19349663) ^ (z * 83492791)
    bucket: int = cells.first[level] + (mixed & (cells.first[level + 1] - cells.first[level] - 1))
    return bucket


@compiled
def gather(cells: Cells, level: int, place: Floats, extent: float, found: Indices) -> int:
    """Write into `found` the bodies of a level that may overlap the cube of half width `extent` [m] around a place.
    Returns how many.
    """
    low, high = int(cells.start[cells.first[level]]), int(cells.start[cells.first[level + 1]])
    reach = extent + cells.extent[level]
    x_a, y_a, z_a = cell_of(cells, level, place, -reach)
    x_b, y_b, z_b = cell_of(cells, level, place, reach)
    if float(x_b - x_a + 1) * float(y_b - y_a + 1) * float(z_b - z_a + 1) >= high - low:
        found[: high - low] = cells.body[low:high]
        return high - low
    count = 0
    for x in range(x_a, x_b + 1):
        for y in range(y_a, y_b + 1):
            for z in range(z_a, z_b + 1):
                bucket = bucket_of(cells, level, x, y, z)
                for row in range(cells.start[bucket], cells.start[bucket + 1]):
                    if cells.cell[row, 0] == x and cells.cell[row, 1] == y and cells.cell[row, 2] == z:
                        found[count] = cells.body[row]
                        count += 1
    return count
