"""Where a check says nothing about a case, and why: each function returns the reason, or an empty text."""

from __future__ import annotations

from impactbench.reports.budget_scales import scales_of
from impactbench.scenarios.records import Law
from impactbench.scenarios.truth import Case


def always(_: Case, __: Law) -> str:
    return ""


def no_pairs(case: Case, _: Law) -> str:
    scene = case.scene
    meets = scene.collide and len(scene.movable) + bool(scene.statics) > 1
    return "" if meets else "no two bodies can touch"


def no_impact(case: Case, law: Law) -> str:
    """Why no single impact of two bodies can be judged by the law of impacts."""
    scene = case.scene
    if scene.model.rotation:
        return "the measure is of particles: with rotation the contact point's velocity is not the centres'"
    if not scene.phase_free:
        return "bodies touch at the start: contacts act together and no pair has an outcome of its own"
    if case.truths[law].kind == "trajectory" and not scales_of(case, law).impacts:
        return "nothing collides"
    return no_pairs(case, law)


def no_restitution(case: Case, law: Law) -> str:
    if any(case.scene.gravity):
        return "under gravity velocity samples straddle a step of it: e is measured without"
    return no_impact(case, law)


def no_impact_time(case: Case, law: Law) -> str:
    return no_impact(case, law) if case.truths[law].impact_times else "the truth gives no instant"


def no_state(case: Case, law: Law) -> str:
    return "" if case.truths[law].kind == "trajectory" else "the truth gives no state at the end"


def no_friction(case: Case, law: Law) -> str:
    scene = case.scene
    contacts = [scene.contact, *(contact for _, _, contact in scene.pairs)]
    rubs = any(c.friction if law == "nc" else c.viscosity for c in contacts)
    if not (rubs and not scene.phase_free):
        return "no lasting contact with friction"
    return no_state(case, law)


def no_flight_truth(case: Case, law: Law) -> str:
    return no_state(case, law) or ("judged by the check of friction" if not no_friction(case, law) else "")


def no_heights(case: Case, law: Law) -> str:
    return "" if case.truths[law].kind == "end state" else "nothing comes to rest upon another"


def no_spin(case: Case, law: Law) -> str:
    if not case.scene.model.rotation:
        return "rotation is not modelled"
    return no_state(case, law)


def no_friction_between(case: Case, law: Law) -> str:
    scene = case.scene
    contacts = [scene.contact, *(contact for _, _, contact in scene.pairs)]
    rubs = any(c.friction > 0 if law == "nc" else c.viscosity > 0 for c in contacts)
    return "friction between bodies whose rotation is not modelled" if rubs and not scene.model.rotation else ""
