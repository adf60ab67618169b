"""Cells that spare the search for a partner among all bodies (Rapaport, The Art of Molecular Dynamics Simulation,
ch. 14).

Space is cut into cubes no smaller than the largest body; only bodies in neighbouring cells can touch before one of them
changes its cell, which is an event of its own. The cubes are counted modulo `number`, so space has no edge: far bodies
that share a number cost a test and nothing else. An axis with fewer than three cells is not cut at all.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from impactbench.reference.compiled import inlined
from impactbench.reference.particles import Indices
from impactbench.scenarios.trajectory import Floats

FEW = 32
"""Up to so many bodies cells cost more than they spare."""

EMPTY = -1


class Cells(NamedTuple):
    """side [m] of the cubes; number of cells per axis, 1 where not cut; cube: that of each body, not wrapped, [n, 3].

    head: first body of each cell; after, before: its neighbours in the cell's list.
    """

    side: Floats
    number: Indices
    cube: Indices
    head: Indices
    after: Indices
    before: Indices


def build_cells(position: Floats, radius: Floats, axes: tuple[int, ...]) -> Cells:
    """About one body per cell, by the space the bodies take at the start."""
    bodies = len(radius)
    count, side = np.ones(3, dtype=np.int64), 1.0
    if bodies > FEW:
        spread = np.ptp(position, axis=0) + 2 * radius.max()
        room = float(np.prod(spread[list(axes)]))
        side = max(2 * float(radius.max()) * (1 + 1e-9), (room / (4 * bodies)) ** (1 / len(axes)))
        wanted = np.floor(spread / side).astype(np.int64)
        count = np.array([wanted[k] if k in axes and wanted[k] >= 3 else 1 for k in range(3)], dtype=np.int64)
    cells = Cells(
        side=np.array([side]),
        number=count,
        cube=np.floor(position / side).astype(np.int64),
        head=np.full(int(np.prod(count)), EMPTY, dtype=np.int64),
        after=np.full(bodies, EMPTY, dtype=np.int64),
        before=np.full(bodies, EMPTY, dtype=np.int64),
    )
    for body in range(bodies):
        enter(cells, body)
    return cells


@inlined
def cell_of(n: Indices, x: int, y: int, z: int) -> int:
    """Number of a cube's cell, counted modulo the numbers of cells n along each axis."""
    return int((x % n[0] * n[1] + y % n[1]) * n[2] + z % n[2])


@inlined
def enter(cells: Cells, body: int) -> None:
    cell = cell_of(cells.number, cells.cube[body, 0], cells.cube[body, 1], cells.cube[body, 2])
    first = cells.head[cell]
    cells.after[body], cells.before[body] = first, EMPTY
    if first != EMPTY:
        cells.before[first] = body
    cells.head[cell] = body


@inlined
def leave(cells: Cells, body: int) -> None:
    after, before = cells.after[body], cells.before[body]
    if after != EMPTY:
        cells.before[after] = before
    if before != EMPTY:
        cells.after[before] = after
    else:
        cells.head[cell_of(cells.number, cells.cube[body, 0], cells.cube[body, 1], cells.cube[body, 2])] = after


@inlined
def cross(cells: Cells, body: int, side: int) -> None:
    """Move a body to the next cell. side: 2 axis for the lower, 2 axis + 1 for the upper neighbour."""
    leave(cells, body)
    cells.cube[body, side // 2] += 1 if side % 2 == 1 else -1
    enter(cells, body)
