"""The checks: what each reads, what it allows, and why that much.

A check compares one measure (reports/measures.py) with a budget. The budget follows from the step h, the order of the
scheme and round-off, by a formula over the case's own scales; its derivation stands beside it and is what
`impactbench explain` prints. No budget lies below a hundred times the derived round-off, so that another processor
or compiler turns nothing red. Files of budgets may override any of them (`budget_file`).

    for check in CHECKS:
        if not check.excused(case, law):
            limit = check.budget(Setting(case, law, step))
"""

from __future__ import annotations

import difflib
from collections.abc import Callable
from dataclasses import dataclass

from impactbench.reports import budget_excuses as excuses
from impactbench.reports import budget_formulas as formulas
from impactbench.reports.budget_formulas import Setting
from impactbench.scenarios.records import Law
from impactbench.scenarios.truth import Case


@dataclass(frozen=True)
class Check:
    """One law of physics against one measure.

    name:     what the command line and reports call it; law: what is conserved or realised.
    measure:  the figure that is read; `side` says which sign counts: "both", "above" (a gain) or "below" (a loss).
    unit:     of the figure and the budget; 1 is a fraction of the scene's scale.
    budget:   largest value allowed.
    excused:  empty, or why the check says nothing about this case under this law.
    formula, derivation: for `impactbench explain`.
    """

    name: str
    law: str
    measure: str
    side: str
    unit: str
    budget: Callable[[Setting], float]
    excused: Callable[[Case, Law], str]
    formula: str
    derivation: str

    def excess(self, value: float) -> float:
        """The part of the figure that counts against the budget: a loss is no gain."""
        return {"both": abs(value), "above": max(value, 0.0), "below": max(-value, 0.0)}[self.side]


def check_named(name: str) -> Check:
    """Raises ValueError with the nearest names."""
    for check in CHECKS:
        if check.name == name:
            return check
    names = [check.name for check in CHECKS]
    near = difflib.get_close_matches(name, names, 1)
    hint = f"did you mean {near[0]}? " if near else ""
    raise ValueError(f"unknown check {name!r}; {hint}known: {', '.join(names)}")


CHECKS: tuple[Check, ...] = (
    Check(
        "momentum",
        "what no contact can have given is conserved (R6)",
        "momentum_drift",
        "both",
        "1",
        formulas.momentum,
        excuses.always,
        "100 n eps, n = T/h",
        "Impulses of a pair are opposite, so that every step adds their rounding alone: one eps of the sum of m |v| a "
        "step, n eps if all fall the same way. A scheme's order does not enter.",
    ),
    Check(
        "angular-momentum",
        "angular momentum about the common centre of mass is conserved (R14, consequence 1)",
        "angular_momentum_drift",
        "both",
        "1",
        formulas.angular_momentum,
        lambda case, law: (
            "statics take up angular momentum" if case.scene.statics else excuses.no_friction_between(case, law)
        ),
        "100 n eps + N h mu_r |u_n| |u_t| / L(0) + h T w^2/2 (free rotation in three dimensions)",
        "Impulses along the line of centres carry no torque. A scheme that finds an impact up to a step late and "
        "then takes out the overlap d <= |u_n| h shifts them along n, where their tangential motion counts mu_r d u_t. "
        "An explicit step of free rotation misses the second-order part of the turn, h^2/2 w^2 L a step.",
    ),
    Check(
        "energy-gain",
        "energy never grows (consequence 4)",
        "energy_gain",
        "above",
        "1",
        formulas.energy_gain,
        excuses.always,
        "100 n eps + h (M g v_g + [contact lasts] |P_g|/2) / E + [rolls] M g N g h^2 / E + h T w^2/2 (free rotation)",
        "Matched positions and velocities conserve energy in free flight. An impact found up to h late turns a "
        "velocity round where the body is up to v_g h too low or, pushed out, as much too high: M g v_g h. While "
        "contact lasts no free flight tells the half step between positions and velocities, 1/2 h |sum of m g . v|. A "
        "ball that begins to roll does so within a step in which contact may carry twice its weight: the fall g h^2 is "
        "work that friction can turn into motion.",
    ),
    Check(
        "energy-excess",
        "the law takes what it takes: no more energy is left at the end than it leaves (R8, R9, R5)",
        "energy_drift",
        "above",
        "1",
        formulas.energy_excess,
        excuses.always,
        "energy-gain + h (1 - e^2) mu_r |u_n| u_t^2 / ((R_A + R_B) E)",
        "As for the gain. Besides, an oblique impact found h late has its line of centres turned by u_t h/(R_A + R_B), "
        "away from the motion: the share (1 - e^2) mu_r u_n^2/2 that the law takes is smaller.",
    ),
    Check(
        "energy-loss",
        "no more energy is lost than the law takes",
        "energy_drift",
        "below",
        "1",
        formulas.energy_loss,
        excuses.always,
        "100 n eps + h (M g v_g + [contact lasts] (|P_g|/2 + M g N g h)) / E + h T w^2/2 (free rotation)",
        "As for the gain. Besides, a body that rests one step of falling too low has lost m g g h^2; in a column of N "
        "up to N times that each.",
    ),
    Check(
        "penetration",
        "bodies do not overlap (R4)",
        "penetration_max",
        "both",
        "1",
        formulas.penetration,
        excuses.no_pairs,
        "(u_n h + N g h^2) / L",
        "Contact is found at the first step that overlaps, at most u_n h deep. A body at rest falls g h^2 in a step "
        "before contact holds it; in a column of N these add up.",
    ),
    Check(
        "restitution",
        "the first impact leaves with e times its approach speed",
        "restitution_error",
        "both",
        "1",
        formulas.restitution,
        excuses.no_restitution,
        "100 * 8 eps",
        "e = -u_n'/u_n is a ratio of sampled velocities and does not depend on when the impact is found, so that only "
        "its own roundings remain: some eight operations.",
    ),
    Check(
        "impact",
        "velocities just after every impact are the law's, for the measured normal and velocities before",
        "impact_velocity_error",
        "both",
        "1",
        formulas.impact,
        excuses.no_impact,
        "100 * 8 eps * max(1, v/u_n)",
        "Judged with the normal and the velocities that the run itself had, an impact owes nothing to the instant at "
        "which it was found: rounding alone remains, next to the pair's own approach.",
    ),
    Check(
        "impact-time",
        "the first impact happens when the bodies meet",
        "impact_time_error",
        "both",
        "s",
        formulas.impact_time,
        excuses.no_impact_time,
        "h; 3/2 h under gravity",
        "A stepped scheme acts at the first step that finds an overlap, up to h late, or at the last one before it. "
        "Semi-implicit flight is off by g h t/2, which at the speed g t of a fall is half a step of time.",
    ),
    Check(
        "position",
        "bodies end where the truth says",
        "position_error",
        "both",
        "1",
        formulas.position,
        excuses.no_flight_truth,
        "(g h T/2 + h sum of (|dv| + (1 + e) mu_r/m |u| |u_t| (T - t)/(R_A + R_B))) / L",
        "Semi-implicit flight is off by g h T/2. An impact found t <= h late displaces what follows by |dv| t, dv "
        "being the velocity that the impact changes. A line of centres meanwhile turns by u_t h/(R_A + R_B), and with "
        "it the impulse: that error of the velocity lasts to the end.",
    ),
    Check(
        "friction",
        "friction of a lasting contact stops, holds or drives a body as far as the law says, in any direction",
        "position_error",
        "both",
        "1",
        formulas.friction,
        excuses.no_friction,
        "(v h + N g h^2) / L",
        "A first-order scheme takes friction a whole step early or late, which displaces by at most v h; distance and "
        "heading both count, as the error is a vector's. Each of N bodies may rest one step of falling too low.",
    ),
    Check(
        "spin",
        "spins end as the truth says",
        "spin_error",
        "both",
        "1",
        formulas.spin,
        excuses.no_spin,
        "100 n eps + g h / v + h T w^2/2 (free rotation)",
        "Without gravity an impact sets the spin in one step, whenever that is. Friction of a lasting contact changes "
        "it by at most g h next to v in the step that it may be early or late.",
    ),
    Check(
        "rest-heights",
        "a stack comes to rest at its heights",
        "position_error",
        "both",
        "1",
        formulas.heights,
        excuses.no_heights,
        "N g h^2 / L",
        "Every contact of a column may be as deep as one step of falling, g h^2, before it is held; the top body is "
        "displaced by all N of them.",
    ),
)
