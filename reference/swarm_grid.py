"""The broad phase: bodies sorted by cells, and lists of the pairs that can touch before any body has moved by half the
skin (Verlet 1967; Hockney & Eastwood, Computer Simulation Using Particles, ch. 8).

A grid's cells are as wide as its largest diameter and the skin, so that only neighbouring cells matter. Bodies outside
the grid count to the cell at its edge: clamping never takes two bodies further apart, so no pair is lost. Spheres of
very different sizes live in grids of their own level; a body looks for larger ones in each coarser level's grid.
"""

from __future__ import annotations

import math

import numpy as np
from impactbench.reference.compiled import compiled
from impactbench.reference.particles import Indices
from impactbench.reference.swarm import (
    BLOCK,
    FASTEST,
    NEAR,
    NEAR_SIDES,
    PAIRS,
    SIDES,
    SKIN,
    Dim,
    Grid,
    Level,
    Numbers,
    Order,
    Starts,
    Swarm,
)
from impactbench.reference.swarm_skin import best_skin, span
from impactbench.reference.swarm_statics import Gap, Statics, gap_to_static
from impactbench.scenarios.trajectory import Floats


@compiled
def build(swarm: Swarm) -> bool:
    """Sort the bodies and list all pairs within the skin. False if a list is too short: nothing but the order has
    changed then, and `tally` says how much room is needed.
    """
    dim, grid, lists, place = swarm.dim, swarm.grid, swarm.lists, swarm.now.place
    place_grids(dim, place, swarm.now.velocity, grid, swarm.gauge, swarm.step)
    sort_bodies(dim, swarm.now, swarm.built, grid)
    skin, pairs = swarm.gauge[SKIN], 0
    for level in range(len(grid.radius)):
        pairs = list_level(dim, place, grid.start, grid.first[level], grid.number[level], skin, lists.pairs, pairs)
        bodies = grid.start[grid.first[level]], grid.start[grid.first[level + 1]]
        for coarser in range(level):
            there = Level(grid.first[coarser], grid.number[coarser], grid.inverse[coarser], grid.origin[coarser])
            pairs = list_across(dim, place, grid.start, there, bodies, skin, lists.pairs, pairs)
    sides = list_sides(dim, place, swarm.statics, skin, grid.radius[0], lists.sides)
    swarm.tally[PAIRS], swarm.tally[SIDES] = pairs, sides
    swarm.tally[NEAR] = swarm.tally[NEAR_SIDES] = 0
    if 2 * pairs >= len(lists.pairs) or 2 * sides > len(lists.sides):
        return False
    note_blocks(lists.pairs, pairs, lists.until)
    return True


@compiled
def note_blocks(pairs: Numbers, count: int, until: Numbers) -> None:
    """How many bodies, in their order, hold those of each `BLOCK` of pairs and of the blocks before."""
    furthest = np.uint32(0)
    for p in range(count):
        furthest = max(furthest, pairs[2 * p], pairs[2 * p + 1])
        until[p // BLOCK] = furthest + 1


@compiled
def place_grids(dim: Dim, place: Floats, velocity: Floats, grid: Grid, gauge: Floats, step: float) -> None:
    """Choose the skin, and each level's cells: at most two a body."""
    d = len(dim)
    n = len(place) // (d + 1)
    low, extent, room = np.zeros(3), np.zeros(3), 1.0
    largest = 2 * grid.radius[0]
    for k in range(d):
        low[k], extent[k] = span(place, k, d + 1)
        room *= max(extent[k], largest)
    fastest = 0.0
    for i in range(n):
        square = 0.0
        for k in range(d):
            square += velocity[i * (d + 1) + k] ** 2
        fastest = max(fastest, square)
    gauge[FASTEST] = math.sqrt(fastest)
    gauge[SKIN] = best_skin(dim, n / room if room > 0 else 0.0, largest, step * gauge[FASTEST])
    for level in range(len(grid.radius)):
        most = grid.first[level + 1] - grid.first[level] - 1
        side = max((2 * grid.radius[level] + gauge[SKIN]) * (1 + 1e-9), 1e-300)
        cells = 1.0
        for k in range(d):
            cells *= max(1.0, extent[k] / side)
        side *= max(1.0, (cells / most) ** (1 / d))
        total = 1
        for k in range(d):
            # Never more than there is room for, even where rounding up short axes to one cell would make it more.
            grid.number[level, k] = max(1, min(int(min(extent[k] / side, 1e9)), most // total))
            total *= grid.number[level, k]
            grid.origin[level, k], grid.inverse[level, k] = low[k], 1 / side


@compiled
def cell_of(dim: Dim, place: Floats, origin: Floats, inverse: Floats, number: Indices, at: int) -> int:
    """Cell of the body whose coordinates start at `at`."""
    cell = 0
    for k in range(len(dim) - 1, -1, -1):
        column = (place[at + k] - origin[k]) * inverse[k]
        cell = cell * number[k] + int(min(max(column, 0.0), float(number[k] - 1)))
    return cell


@compiled
def sort_bodies(dim: Dim, now: Order, built: Order, grid: Grid) -> None:
    """Counting sort by level and cell. It keeps the order within a cell, so that a body's way stays short."""
    stride, n, start, cell = len(dim) + 1, len(now.label), grid.start, grid.cell
    place, velocity, mass, label = now.place, now.velocity, now.inverse_mass, now.label
    place_to, velocity_to, mass_to, label_to = built.place, built.velocity, built.inverse_mass, built.label
    start[:] = 0
    for i in range(n):
        level = grid.level[label[i]]
        c = cell_of(dim, place, grid.origin[level], grid.inverse[level], grid.number[level], i * stride)
        cell[i] = grid.first[level] + c
        start[cell[i] + 1] += 1
    for c in range(len(start) - 1):
        start[c + 1] += start[c]
    for i in range(n):
        to = start[cell[i]]
        start[cell[i]] = to + 1
        for k in range(stride):
            place_to[to * stride + k] = place[i * stride + k]
            velocity_to[to * stride + k] = velocity[i * stride + k]
        mass_to[to], label_to[to] = mass[i], label[i]
    for c in range(len(start) - 1, 0, -1):
        start[c] = start[c - 1]
    start[0] = 0
    for k in range(len(place)):
        place[k], velocity[k] = place_to[k], velocity_to[k]
    for i in range(n):
        mass[i], label[i] = mass_to[i], label_to[i]


@compiled
def list_level(
    dim: Dim, place: Floats, start: Starts, first: int, n: Indices, skin: float, pairs: Numbers, count: int
) -> int:
    """Pairs of one level: each cell with itself and with the half of its neighbours that come later. Cell c begins at
    start[first + c]; n: cells along each axis. Returns how many pairs there are now; those beyond the room in `pairs`
    are only counted.

    Cells along x follow one another, so that three neighbours are one run of bodies.
    """
    n_x, n_y, n_z = n[0], n[1], n[2]
    low, high = np.zeros(5, dtype=np.int64), np.zeros(5, dtype=np.int64)
    for z in range(n_z):
        for y in range(n_y):
            for x in range(n_x):
                row = first + (z * n_y + y) * n_x
                begin, end = start[row + x], start[row + x + 1]
                if begin == end:
                    continue
                left, right = max(x - 1, 0), min(x + 1, n_x - 1) + 1
                high[0], runs = start[row + right], 1
                if len(dim) > 1:
                    for r in range(4):
                        up, across = (0, 1) if r == 0 else (1, r - 2)
                        if 0 <= y + across < n_y and z + up < n_z:
                            other = row + (up * n_y + across) * n_x
                            low[runs], high[runs] = start[other + left], start[other + right]
                            runs += 1
                for i in range(begin, end):
                    low[0] = i + 1
                    for r in range(runs):
                        count = list_run(dim, place, skin, pairs, i, low[r], high[r], count)
    return count


@compiled
def list_across(
    dim: Dim, place: Floats, start: Starts, grid: Level, finer: tuple[int, int], skin: float, pairs: Numbers, count: int
) -> int:
    """Pairs of a body finer[0] ... finer[1] - 1 and one of a coarser level, whose cells are wide enough for both."""
    d = len(dim)
    n_x, n_y, n_z = grid.number[0], grid.number[1], grid.number[2]
    for i in range(finer[0], finer[1]):
        cell = cell_of(dim, place, grid.origin, grid.inverse, grid.number, i * (d + 1))
        x, y, z = cell % n_x, cell // n_x % n_y, cell // (n_x * n_y)
        for up in range(max(z - 1, 0), min(z + 1, n_z - 1) + 1):
            for across in range(max(y - 1, 0), min(y + 1, n_y - 1) + 1):
                row = grid.first + (up * n_y + across) * n_x
                low, high = start[row + max(x - 1, 0)], start[row + min(x + 1, n_x - 1) + 1]
                count = list_run(dim, place, skin, pairs, i, low, high, count)
    return count


@compiled
def list_run(dim: Dim, place: Floats, skin: float, pairs: Numbers, i: int, low: int, high: int, count: int) -> int:
    """Add the bodies low ... high - 1 that are within the skin of body i. Without a branch: a pair is always written,
    and counted where it is one.
    """
    d = len(dim)
    x = place[i * (d + 1)]
    y = place[i * (d + 1) + 1] if d > 1 else 0.0
    z = place[i * (d + 1) + 2] if d > 2 else 0.0
    reach = place[i * (d + 1) + d] + skin
    last = len(pairs) // 2 - 1
    for j in range(np.uint64(low), np.uint64(high)):
        at = np.uint64(j) * np.uint64(d + 1)
        off = x - place[at]
        square = off * off
        if d > 1:
            off = y - place[at + np.uint64(1)]
            square += off * off
        if d > 2:
            off = z - place[at + np.uint64(2)]
            square += off * off
        sure = reach + place[at + np.uint64(d)]
        entry = np.uint64(2 * min(count, last))
        pairs[entry], pairs[entry + np.uint64(1)] = i, j
        count += square < sure * sure
    return count


@compiled
def list_sides(dim: Dim, place: Floats, statics: Statics, skin: float, radius: float, sides: Numbers) -> int:
    """Bodies within half the skin of a static, which does not move. radius [m]: of the largest body."""
    d, count = len(dim), 0
    everywhere = skin / 2 + radius > statics.reach
    for s in statics.planes:
        count = list_plane(dim, place, s, statics.place[s], statics.size[s], skin, sides, count)
    if len(statics.solids) == 0:
        return count
    for i in range(len(place) // (d + 1)):
        if everywhere:
            found = statics.solids
        else:
            cell = cell_of(dim, place, statics.origin, statics.inverse, statics.number, i * (d + 1))
            found = statics.item[statics.start[cell] : statics.start[cell + 1]]
        for s in found:
            count = list_side(dim, place, statics.kind, statics.place, statics.size, s, i, skin, sides, count)
    return count


@compiled
def list_plane(
    dim: Dim, place: Floats, s: int, point: Floats, normal: Floats, skin: float, sides: Numbers, count: int
) -> int:
    """`list_sides` of plane s alone: planes see every body, so this loop is kept bare."""
    d = len(dim)
    x, y, z = normal[0], normal[1], normal[2]
    level = x * point[0] + y * point[1] + z * point[2] + skin / 2
    for i in range(len(place) // (d + 1)):
        at = i * (d + 1)
        height = x * place[at]
        if d > 1:
            height += y * place[at + 1]
        if d > 2:
            height += z * place[at + 2]
        if height - place[at + d] <= level:
            if 2 * count < len(sides):
                sides[2 * count], sides[2 * count + 1] = i, s
            count += 1
    return count


@compiled
def list_side(
    dim: Dim,
    place: Floats,
    kind: Indices,
    where: Floats,
    size: Floats,
    s: int,
    i: int,
    skin: float,
    sides: Numbers,
    count: int,
) -> int:
    if side_gap(dim, place, kind, where, size, i, s)[0] <= skin / 2:
        if 2 * count < len(sides):
            sides[2 * count], sides[2 * count + 1] = i, s
        count += 1
    return count


@compiled
def side_gap(dim: Dim, place: Floats, kind: Indices, where: Floats, size: Floats, i: int, s: int) -> Gap:
    """Gap [m] of body i and static s and the normal from the static to the body."""
    d = len(dim)
    at = i * (d + 1)
    y = place[at + 1] if d > 1 else 0.0
    z = place[at + 2] if d > 2 else 0.0
    return gap_to_static(d, kind[s], where, size, s, place[at], y, z, place[at + d])
