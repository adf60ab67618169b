"""Impacts of one instant, pair after pair, by the laws of `rigid_impact` (R14) and `rigid_newton`."""

from __future__ import annotations

import numpy as np
from impactbench.reference import rigid_impact, rigid_newton
from impactbench.reference.compiled import compiled
from impactbench.reference.particles import Flags, Indices
from impactbench.reference.rigid_body import Rigid, static
from impactbench.reference.rigid_motion import Steps
from impactbench.reference.rigid_touches import Touches, parting
from impactbench.reference.solids import Solids
from impactbench.scenarios.records import Law, Scene
from impactbench.scenarios.trajectory import Floats

SWEEPS = 200


def strike_all(scene: Scene, law: Law, solids: Solids, touches: Touches, steps: Steps) -> None:
    """Pair after pair until none approaches faster than gravity explains; what lasts and closes stays lasting.

    A train of ever weaker blows that goes on after `SWEEPS` is left to the lasting contacts.
    """
    open_to = ~((touches.known >= 0) & approaching(solids, touches, steps, touches.key >= 0))
    ends = np.flatnonzero(np.diff(touches.first) | np.diff(touches.second)) + 1
    pairs = np.split(np.arange(len(touches.key)), ends)
    for _ in range(SWEEPS):
        struck = False
        for pair in pairs:
            meeting = pair[approaching(solids, touches, steps, open_to)[pair]]
            if len(meeting):
                strike(scene, law, solids, touches, meeting)
                struck = True
        if not struck:
            return


@compiled
def approaching(solids: Solids, touches: Touches, steps: Steps, of: Flags) -> Flags:
    """Which contacts `of` these approach faster than gravity along the normal alone explains, 2 h |g . n| (rule R3)."""
    fast = of.copy()
    for c in range(len(fast)):
        n = touches.normal[c]
        along = abs(steps.gravity[0] * n[0] + steps.gravity[1] * n[1] + steps.gravity[2] * n[2])
        slow = max(steps.still, 2 * steps.step * along)
        fast[c] = of[c] and parting(solids.velocity, solids.spin, touches, c) < -slow
    return fast


def strike(scene: Scene, law: Law, solids: Solids, touches: Touches, meeting: Indices) -> None:
    """One impact of a pair, at the middle of the points that meet at this instant: a box that lands flat does not turn.

    In a planar scene only the turn about its axis is kept; shapes are symmetric to the plane, so there is no other.
    """
    first, second = int(touches.first[meeting[0]]), int(touches.second[meeting[0]])
    point, normal = touches.point[meeting].mean(axis=0), touches.normal[meeting].mean(axis=0)
    normal /= np.linalg.norm(normal)
    a, b = _rigid(solids, first, point), _rigid(solids, second, point)
    contact = scene.contact_of(first, second)
    if law == "doc":
        after = rigid_impact.bounce(a, b, normal, contact.bounciness)
    else:
        after = rigid_newton.restitution(a, b, normal, contact.bounciness, contact.friction)
    for i, body, (velocity, spin) in zip((first, second), (a, b), after, strict=True):
        if not body.static:
            solids.velocity[i], solids.spin[i] = velocity, spin


def _rigid(solids: Solids, i: int, point: Floats) -> Rigid:
    arm = point - solids.position[i]
    if solids.lightness[i] == 0:
        return static(arm)
    inertia = (solids.axes[i] * solids.principal[i]) @ solids.axes[i].T
    return Rigid(1 / solids.lightness[i], inertia, solids.velocity[i].copy(), solids.spin[i].copy(), arm)
