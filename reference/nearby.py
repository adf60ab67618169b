"""Which pairs are looked at: those that may touch before a body has left its room, found from cells at a cost that does
not grow with the square of the bodies (Verlet 1967, with a skin of its own for each body).

Every body gets room [m] to move in, the more the faster it is. A list holds the pairs whose gap is within the room of
both, so that a pair that is not listed stays apart until one of them has left its room. Of few bodies all pairs are
listed once and for all: their room has no end. Two statics are never paired (documents, rule R2): only movable bodies
look for others.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from impactbench.reference.cells import Cells, build_cells, exponent_of, gather
from impactbench.reference.coefficients import Coefficients, key_of, pair_key
from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.gaps import between, locate
from impactbench.reference.pair_list import in_order, no_pairs, relisted, remembered
from impactbench.reference.pairs import handled_pairs
from impactbench.reference.particles import HALF_SPACE, Bodies, Indices, Pairs
from impactbench.reference.progress import Progress
from impactbench.scenarios.records import Scene
from impactbench.scenarios.trajectory import Floats

SKIN, AHEAD = 0.1, 4.0
"""A body's room: so much of the bodies' mean half width, and its way in so many steps."""


class Rooms(NamedTuple):
    """movable: numbers of the movable bodies. centre [m] [n, 3]: places at the last listing; size [m] [n]: how far a
    body may go from there.
    """

    movable: Indices
    centre: Floats
    size: Floats


class Nearby(NamedTuple):
    """planes: numbers of the half-spaces; solids: the other statics. spare [m]: the room of a body at rest; ahead [s]:
    what a moving one gets is its way in that time. along: 1 on the axes along which anything moves.
    """

    rooms: Rooms
    planes: Indices
    solids: Cells
    coefficients: Coefficients
    spare: float
    ahead: float
    along: Floats


def build_nearby(scene: Scene, bodies: Bodies, coefficients: Coefficients, along: Floats, step: float) -> Nearby:
    """For a list of pairs that is empty so far: nobody has room."""
    movable = np.array(scene.movable if scene.collide else (), dtype=np.int64)
    extent = half_width(bodies)
    return Nearby(
        rooms=Rooms(movable, bodies.position.copy(), np.where(bodies.inverse_mass > 0, -1.0, 0.0)),
        planes=np.flatnonzero(bodies.shape == HALF_SPACE),
        solids=build_cells(
            np.flatnonzero((bodies.inverse_mass == 0) & (bodies.shape != HALF_SPACE)), bodies.position, extent, along
        ),
        coefficients=coefficients,
        spare=SKIN * float(extent[movable].mean()) if len(movable) else 0.0,
        ahead=AHEAD * step,
        along=along,
    )


def list_all(scene: Scene, bodies: Bodies, nearby: Nearby) -> Pairs:
    """All handled pairs, for good: room without end."""
    nearby.rooms.size[nearby.rooms.movable] = np.inf
    return all_pairs(scene, bodies, nearby.coefficients)


def all_pairs(scene: Scene, bodies: Bodies, coefficients: Coefficients) -> Pairs:
    """Every handled pair of a scene."""
    handled = handled_pairs(scene.statics, scene.movable) if scene.collide else ()
    keys = [pair_key(coefficients.rank, a, b) for a, b in handled]
    return relisted(no_pairs(), np.array(keys, dtype=np.int64), bodies, coefficients)


@compiled
def half_width(bodies: Bodies) -> Floats:
    """Half the widest side [m] of each body, [n]; without meaning for half-spaces."""
    width = np.zeros(len(bodies.size))
    for i in range(len(width)):
        width[i] = max(bodies.size[i, 0], bodies.size[i, 1], bodies.size[i, 2])
    return width


@compiled
def look(bodies: Bodies, pairs: Pairs, reach: float) -> float:
    """Bring the gaps up to date; of pairs that cannot have met since they were seen apart, to a lower bound above
    `reach` [m]. Returns the depth [m] of the deepest overlap, else 0.
    """
    travel = 0.0
    for i in range(len(bodies.inverse_mass)):
        travel = max(travel, squared_way(bodies.position, bodies.seen, i))
    bodies.seen[:] = bodies.position
    # Sums of travels lose some of their last digits: a little more keeps the bound sure.
    pairs.odometer[0] += 2 * math.sqrt(travel) * (1 + 1e-9)
    now, gap, clear, deepest = pairs.odometer[0], pairs.gap, pairs.clear, 0.0
    for p in range(len(gap)):
        if clear[p] - now > 2 * reach and pairs.reach[p] == 0.0:
            gap[p] = clear[p] - now
        else:
            locate(bodies, pairs, p)
            clear[p] = now + gap[p]
            deepest = max(deepest, -gap[p])
    return deepest


@inlined
def squared_way(position: Floats, origin: Floats, i: int) -> float:
    x, y, z = position[i, 0] - origin[i, 0], position[i, 1] - origin[i, 1], position[i, 2] - origin[i, 2]
    square: float = x * x + y * y + z * z
    return square


@inlined
def all_listed(position: Floats, rooms: Rooms, progress: Progress, reach: float) -> bool:
    """Whether all pairs within `reach` [m] are still listed; where not, `progress` wants them."""
    for i in rooms.movable:
        left = rooms.size[i] - reach
        if left < 0 or squared_way(position, rooms.centre, i) > left * left:
            progress.wanted[0] = reach
            return False
    return True


@compiled
def list_anew(bodies: Bodies, pairs: Pairs, nearby: Nearby, reach: float) -> Pairs:
    """Give every movable body its room, and list the pairs within it and those whose contact is not over."""
    for i in nearby.rooms.movable:
        v = bodies.velocity[i]
        speed = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        nearby.rooms.size[i] = 2 * reach + nearby.spare + nearby.ahead * speed
    nearby.rooms.centre[:] = bodies.position
    kept = remembered(pairs, nearby.coefficients.rank)
    keys = np.concatenate((near_keys(bodies, nearby), kept))
    return relisted(pairs, in_order(keys, len(bodies.inverse_mass)), bodies, nearby.coefficients)


@compiled
def near_keys(bodies: Bodies, nearby: Nearby) -> Indices:
    """Keys of the pairs whose gap is within the room of both."""
    room, rank = nearby.rooms.size, nearby.coefficients.rank
    extent, place, solids = half_width(bodies) + room, bodies.position, nearby.solids
    cells = build_cells(nearby.rooms.movable, place, extent, nearby.along)
    found, keys, count = np.zeros(len(rank), dtype=np.int64), np.zeros(64 + 16 * len(rank), dtype=np.int64), 0
    found[: len(nearby.planes)] = nearby.planes
    for i in nearby.rooms.movable:
        seen, own = len(nearby.planes), exponent_of(extent[i])
        for level in range(len(solids.exponent)):
            seen += gather(solids, level, place[i], extent[i], found[seen:])
        # The smaller of two movable bodies finds the larger one; of two on one level, the first the second.
        for level in range(np.searchsorted(cells.exponent, own), len(cells.exponent)):
            seen += gather(cells, level, place[i], extent[i], found[seen:])
        while count + seen > len(keys):
            keys = np.concatenate((keys, np.zeros_like(keys)))
        for other in found[:seen]:
            if bodies.inverse_mass[other] > 0 and other <= i and exponent_of(extent[other]) == own:
                continue
            if between(bodies, other, i)[0] <= room[other] + room[i]:
                keys[count] = key_of(rank, other, i)
                count += 1
    return keys[:count]
