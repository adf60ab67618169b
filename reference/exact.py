"""The exact runner: from event to event, without a step (Alder & Wainwright 1959; Lubachevsky 1991).

Every sphere keeps its own time and its own next event. The earliest event of all is taken: if the partner has changed
its motion since, the sphere looks again, else the impact is resolved and both look for their next.

Impacts of several pairs at one instant that hang together are taken at once (`exact_together`), so that a symmetric
scene stays symmetric to round-off. Where bounciness differs among them they are taken one after the other, lowest
sphere first, and again while any pair approaches: then the outcome depends on that order.
"""

from __future__ import annotations

from impactbench.reference.compiled import compiled, inlined
from impactbench.reference.events_queue import earliest
from impactbench.reference.exact_impact import settle, strike_sphere, strike_wall
from impactbench.reference.exact_predict import EDGE, SPHERE, enter_cell, fly, predict
from impactbench.reference.exact_together import several, strike_together
from impactbench.reference.exact_world import RADIUS, SPEED, World

REACHED, TOO_MANY, CROWDED, AT_EDGE = 0, 1, 2, 3
"""How a run ends: at its time, at the bound of events, at impacts without end in one instant, at a box's edge."""

IMPACT, ALONE = 4, 5
"""What is left to do of an event: an impact; an impact of one pair only."""

CROWD = 1000
"""Events of one sphere in one instant from which on they are taken to have no end."""


@compiled
def begin(world: World) -> None:
    """Contacts with walls that neither approach nor leave at t = 0 are lasting ones (documents, rule R3)."""
    s, walls, rules = world.spheres, world.walls, world.rules
    for i in range(rules.movable):
        for w in range(len(walls.level)):
            gap, speed, pull = -walls.level[w] - s.motion[i, RADIUS], 0.0, 0.0
            for k in range(3):
                gap += s.motion[i, k] * walls.normal[w, k]
                speed += s.motion[i, SPEED + k] * walls.normal[w, k]
                pull += rules.gravity[k] * walls.normal[w, k]
            inside = (s.motion[i, :3] >= walls.low[w]).all() and (s.motion[i, :3] <= walls.high[w]).all()
            s.rests[i, w] = inside and abs(gap) <= rules.touch and abs(speed) <= rules.rest and pull < 0.0
        settle(world, i)
    for i in range(rules.movable):
        predict(world, i, 0.0)


@compiled
def run(world: World, until: float, most: int) -> tuple[int, float]:
    """Process all events up to and at `until` [s], at most `most`. Returns how it ended, and the time of the end."""
    queue = world.queue
    for _ in range(most):
        i = earliest(queue)
        now = queue.due[i]
        if not now <= until:
            return REACHED, until
        outcome = come_to(world, i, now)
        if outcome == IMPACT:
            outcome = strike_all(world, i, now) if several(world, i, now) else ALONE
            if outcome == ALONE:
                outcome = strike(world, i, now)
        if outcome != REACHED:
            return outcome, now
    return TOO_MANY, queue.due[earliest(queue)]


@inlined
def come_to(world: World, i: int, now: float) -> int:
    """The event of sphere i, as far as it is none that changes velocities; else `IMPACT` or `AT_EDGE`."""
    s = world.spheres
    if s.leaves[i]:
        enter_cell(world, i, now)
        return REACHED
    if s.kind[i] == EDGE:
        return AT_EDGE
    if s.kind[i] == SPHERE and s.partner_events[i] != s.events[s.partner[i]]:
        predict(world, i, now)
        return REACHED
    return IMPACT


@inlined
def strike(world: World, i: int, now: float) -> int:
    """The impact of sphere i with its partner."""
    s, partner = world.spheres, world.spheres.partner[i]
    crowded = count_event(world, i, now)
    if s.kind[i] == SPHERE:
        crowded |= count_event(world, partner, now)
        crowded |= strike_sphere(world, i, partner)
        world.tally[0] += 1
        if partner < world.rules.movable:
            settle(world, partner)
            predict(world, partner, now)
    else:
        strike_wall(world, i, partner)
        world.tally[1] += 1
    settle(world, i)
    predict(world, i, now)
    return CROWDED if crowded else REACHED


@compiled
def strike_all(world: World, i: int, now: float) -> int:
    """The impacts of this instant that hang together with sphere i; `ALONE` if it meets one partner only."""
    members = strike_together(world, i, now)
    if len(members) == 0:
        return ALONE
    crowded = False
    for k in members:
        crowded |= count_event(world, k, now)
        settle(world, k)
    for k in members:
        predict(world, k, now)
    return CROWDED if crowded else REACHED


@inlined
def count_event(world: World, i: int, now: float) -> bool:
    """Bring sphere i to its event and count it. True if its events no longer get on in time."""
    s = world.spheres
    span = max(world.rules.instant, 4e-16 * now)
    s.crowd[i] = s.crowd[i] + 1 if now - s.struck[i] <= span else 0
    s.events[i] += 1
    s.struck[i] = now
    fly(world, i, now)
    return bool(s.crowd[i] > CROWD and s.inverse_mass[i] > 0.0)
