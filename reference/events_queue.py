"""Priority queue of the bodies by the time of their own next event: a knock-out tournament among neighbours (Marin,
Risso & Cordero 1993, J. Comput. Phys. 109, 306).

Every body holds one event, its earliest (Lubachevsky 1991), so the tree never grows. A changed time is played up the
tree until it no longer decides a match. Equal times are taken by the lower body number.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from impactbench.reference.compiled import inlined
from impactbench.reference.particles import Indices
from impactbench.scenarios.trajectory import Floats


class Queue(NamedTuple):
    """due [s] per body, infinite for places without one, shape [p], p a power of two; winner: body with the earliest
    event below each node, shape [2 p]: the root is 1, the children of k are 2 k and 2 k + 1, the leaves begin at p.
    """

    due: Floats
    winner: Indices


def build_queue(count: int) -> Queue:
    places = 1 << max(1, (count - 1).bit_length())
    winner = np.zeros(2 * places, dtype=np.int64)
    winner[places:] = np.arange(places)
    for node in range(places - 1, 0, -1):
        winner[node] = winner[2 * node]
    return Queue(np.full(places, np.inf), winner)


@inlined
def earliest(queue: Queue) -> int:
    """The body whose event comes first."""
    return int(queue.winner[1])


@inlined
def reschedule(queue: Queue, body: int, due: float) -> None:
    """Give a body's event another time and play its matches again."""
    times, winner = queue.due, queue.winner
    times[body] = due
    node = (len(times) + body) // 2
    while node > 0:
        left, right = winner[2 * node], winner[2 * node + 1]
        best = right if times[right] < times[left] else left
        if best == winner[node] and best != body:
            return
        winner[node] = best
        node //= 2
