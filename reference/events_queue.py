"""Priority queue of the bodies by the time of their own next event: a binary heap that knows where each body sits.

Every body holds one event, its earliest (Lubachevsky 1991), so the heap never grows and changes in O(log n). Equal
times are taken by the lower body number.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from impactbench.reference.compiled import compiled
from impactbench.reference.particles import Indices
from impactbench.scenarios.trajectory import Floats


class Queue(NamedTuple):
    """due [s] per body; heap: body at each place; place: where each body sits. Shapes [n]."""

    due: Floats
    heap: Indices
    place: Indices


def build_queue(count: int) -> Queue:
    return Queue(np.full(count, np.inf), np.arange(count, dtype=np.int64), np.arange(count, dtype=np.int64))


@compiled
def reschedule(queue: Queue, body: int, due: float) -> None:
    """Give a body's event another time and bring the heap in order."""
    queue.due[body] = due
    place = rise(queue, body, queue.place[body])
    sink(queue, body, place)


@compiled
def sooner(queue: Queue, a: int, b: int) -> bool:
    return bool(queue.due[a] < queue.due[b] or (queue.due[a] == queue.due[b] and a < b))


@compiled
def rise(queue: Queue, body: int, place: int) -> int:
    while place > 0:
        above = (place - 1) // 2
        other = queue.heap[above]
        if not sooner(queue, body, other):
            break
        queue.heap[place], queue.place[other] = other, place
        place = above
    queue.heap[place], queue.place[body] = body, place
    return place


@compiled
def sink(queue: Queue, body: int, place: int) -> None:
    count = len(queue.heap)
    while 2 * place + 1 < count:
        below = 2 * place + 1
        if below + 1 < count and sooner(queue, queue.heap[below + 1], queue.heap[below]):
            below += 1
        other = queue.heap[below]
        if not sooner(queue, other, body):
            break
        queue.heap[place], queue.place[other] = other, place
        place = below
    queue.heap[place], queue.place[body] = body, place
