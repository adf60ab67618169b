"""The form of a truth, and of a case: a scene with a truth for each law it can be run under."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

from impactbench.scenarios.records import Law, Scene
from impactbench.scenarios.trajectory import State

Kind = Literal["trajectory", "end state", "invariant"]


@dataclass(frozen=True, eq=False)
class Truth:
    """What must come out, from a closed form and never from a contestant.

    kind:         `trajectory` (state at every time), `end state` (state once settled) or `invariant` (no state:
    conservation only).
    state:        time [s] -> the movable bodies' state, or None at times where nothing is known.
    impact_times: instants [s] of the impacts, ascending, as far as known; may be empty.
    horizon:      time [s] until which the state is known in spite of round-off: finite where the motion is chaotic
    (see reports/predictability.py). Errors are taken up to it.
    """

    kind: Kind
    state: Callable[[float], State | None]
    impact_times: tuple[float, ...] = ()
    horizon: float = math.inf


@dataclass(frozen=True, eq=False)
class Case:
    """A scene with its truths. `headline` names the measure that "1 % error" means in its family."""

    scene: Scene
    truths: Mapping[Law, Truth]
    headline: str = "position_error"
    from_file: bool = False
    """Whether a scene file describes it: the catalogue then does not know its name."""


@dataclass(frozen=True, eq=False)
class Family:
    """A function of parameters. `cases` builds the default cases; `question` and `needs` are for the reader of a
    list."""

    name: str
    question: str
    needs: str
    cases: Callable[[], list[Case]]
