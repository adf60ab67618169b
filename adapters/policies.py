"""Policies: an engine, a profile and the solver settings that matter, each with its source.

`mujoco/tuned:iterations=20,cone=pyramidal` is the profile `tuned` with two settings changed, by the engine's own names.
Settings are checked here, so that a mistake is told before any engine is loaded.
"""

from __future__ import annotations

import difflib
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

Value = int | float | str
Options = tuple[tuple[str, Value], ...]


@dataclass(frozen=True)
class Setting:
    """One solver setting of an engine: one of `words`, else a number of at least `least` and at most `most`."""

    name: str
    source: str
    words: tuple[str, ...] = ()
    whole: bool = False
    least: float = 0.0
    most: float = math.inf

    @property
    def allowed(self) -> str:
        if self.words:
            return " or ".join(self.words)
        span = f"from {self.least:g} to {self.most:g}" if self.most < math.inf else f"of at least {self.least:g}"
        return f"a {'whole ' if self.whole else ''}number {span}"

    def value(self, given: object) -> Value:
        """`given` as the engine takes it. Raises ValueError with what is allowed."""
        fault = ValueError(f"{self.name}={given} is not possible: it takes {self.allowed}")
        if self.words:
            if str(given) not in self.words:
                raise fault
            return str(given)
        try:
            number = float(str(given))
        except ValueError:
            raise fault from None
        if not (math.isfinite(number) and self.least <= number <= self.most) or (self.whole and number % 1):
            raise fault
        return int(number) if self.whole else number


_XML = "MuJoCo XML reference, option/"
_GUIDE = "PyBullet Quickstart Guide, setPhysicsEngineParameter"
_SPACE = "pymunk reference, Space."
SETTINGS: dict[str, tuple[Setting, ...]] = {
    "reference": (),
    "mujoco": (
        Setting("integrator", _XML + "integrator", ("Euler", "RK4", "implicit", "implicitfast")),
        Setting("cone", _XML + "cone", ("pyramidal", "elliptic")),
        Setting("solver", _XML + "solver", ("PGS", "CG", "Newton")),
        Setting("jacobian", _XML + "jacobian", ("dense", "sparse", "auto")),
        Setting("iterations", _XML + "iterations", whole=True, least=1),
        Setting("ls_iterations", _XML + "ls_iterations", whole=True, least=1),
        Setting("noslip_iterations", _XML + "noslip_iterations", whole=True),
        Setting("tolerance", _XML + "tolerance", most=1),
        Setting("impratio", _XML + "impratio", least=1e-6),
    ),
    "pybullet": (
        Setting("numSolverIterations", _GUIDE, whole=True, least=1),
        Setting("numSubSteps", _GUIDE, whole=True, least=1),
        Setting("solverResidualThreshold", _GUIDE),
        Setting("contactERP", _GUIDE, most=1),
        Setting("erp", _GUIDE, most=1),
        Setting("frictionERP", _GUIDE, most=1),
        Setting("contactSlop", _GUIDE),
        Setting("restitutionVelocityThreshold", _GUIDE),
        Setting("useSplitImpulse", _GUIDE, whole=True, most=1),
        Setting("enableConeFriction", _GUIDE, whole=True, most=1),
    ),
    "pymunk": (
        Setting("iterations", _SPACE + "iterations", whole=True, least=1),
        Setting("collision_slop", _SPACE + "collision_slop"),
        Setting("collision_bias", _SPACE + "collision_bias", most=1),
        Setting("collision_persistence", _SPACE + "collision_persistence", whole=True),
    ),
}
"""By engine, in the order names are written in."""

SOURCES = {
    "reference/stepped": "rules of the documents; semi-implicit steps, impacts at the first overlapping step",
    "reference/revert": "documents, rule R4: overlapping bodies go back to where the step began",
    "reference/force": "documents, rule R5: viscous friction as an explicit force, refused where it would reverse",
    "reference/positions": "documents, rule R4: projections also change velocities, close to an inelastic impact",
    "reference/exact": "rules of the documents, from event to event; no step",
    "mujoco/default": "vendor's defaults (XML reference, option and geom): Euler, pyramidal cone, solref 0.02 1",
    "mujoco/tuned": "XML reference, solref: direct damping (1+e)/h answers an impact within one step; elliptic cone",
    "mujoco/stiff": "XML reference, solref: shortest advised time constant, 2 h, critically damped",
    "mujoco/cushion": "XML reference, solref: direct stiffness and damping, an overlap goes back over 50 steps",
    "mujoco/speculative": "XML reference, option/flag: contacts before bodies touch, against tunnelling",
    "mujoco/implicit": "Computation, numerical integration: velocity forces implicit, gyroscopic ones included",
    "mujoco/implicitfast": "Computation, numerical integration: the recommended integrator; no gyroscopic derivatives",
    "mujoco/rk4": "Computation, numerical integration: fourth order between contacts; one-step impacts do not fit it",
    "pybullet/default": "vendor's defaults (Quickstart Guide): reduced coordinates, 50 iterations, damping 0.04",
    "pybullet/tuned": "Quickstart Guide: thresholds, slop, damping 0; coordinates by what the scene needs (measured)",
    "pybullet/iterations": "Quickstart Guide: numSolverIterations trades speed for accuracy; 200 instead of 50",
    "pybullet/swept": "Quickstart Guide: ccdSweptSphereRadius, against tunnelling",
    "pybullet/maximal": "SimBenchmark's Bullet: maximal coordinates, overlaps left alone",
    "pybullet/multibody": "SimBenchmark's Bullet multibody: reduced coordinates, overlaps left alone",
    "pymunk/default": "vendor's defaults (reference, Space): 10 iterations, slop 0.1",
    "pymunk/tuned": "reference, Space: slop 1e-4 of the scene's length, 30 iterations, 100 where bodies rest",
    "pymunk/iterations": "reference, Space.iterations: for stacks and mass ratios; 500",
    "pymunk/substeps": "manual: smaller steps for fast bodies; none further than half the smallest body",
    "mujoco/default:integrator=implicitfast": "Computation, numerical integration: recommended for most models",
    "mujoco/default:cone=elliptic": "Computation, friction cones: the physical cone instead of its pyramid",
    "mujoco/default:noslip_iterations=10": "Modelling, preventing slip: a pass that takes out what slip is left",
    "mujoco/default:solver=CG": "Computation, solver algorithms: cheaper iterations for large models",
    "pybullet/default:numSubSteps=4": "Quickstart Guide: each step in four parts",
    "pymunk/default:collision_slop=0.001": "reference, Space.collision_slop: as small as stays stable",
}
"""Where each policy of the table comes from."""


def option_policies() -> list[str]:
    """Policies of the table that are a profile with settings."""
    return [name for name in SOURCES if ":" in name]


def is_policy(text: str) -> bool:
    """Whether `text` means a contestant with settings, rather than a user's own class."""
    head, colon, tail = text.partition(":")
    return bool(colon) and ("=" in tail or head in SOURCES)


def parse(text: str) -> tuple[str, Options]:
    """Contestant and settings of `mujoco/tuned:iterations=20,cone=pyramidal`. Raises ValueError in one line."""
    base, _, tail = text.partition(":")
    given = {}
    for part in tail.split(","):
        name, equals, value = (word.strip() for word in part.partition("="))
        if not (name and equals and value):
            raise ValueError(f"policy {text!r}: {part!r} is not a setting; write {base}:name=value,name=value")
        if name in given:
            raise ValueError(f"policy {text!r}: {name} is given twice")
        given[name] = value
    return base, options(text, base, given)


def options(text: str, base: str, given: Mapping[str, object]) -> Options:
    """The settings of a policy, checked, in the table's order. Raises ValueError in one line."""
    if base not in SOURCES or ":" in base:
        near = difflib.get_close_matches(base, [name for name in SOURCES if ":" not in name], 1)
        hint = f"; did you mean {near[0]}?" if near else "; settings go with ENGINE/PROFILE, as in mujoco/tuned"
        raise ValueError(f"policy {text!r}: there is no profile {base!r}{hint}")
    known = {setting.name: setting for setting in SETTINGS[base.partition("/")[0]]}
    for name in given:
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            hint = f"did you mean {near[0]}? " if near else ""
            raise ValueError(f"policy {text!r}: unknown setting {name!r}; {hint}known: {', '.join(known) or 'none'}")
    try:
        return tuple((name, setting.value(given[name])) for name, setting in known.items() if name in given)
    except ValueError as error:
        raise ValueError(f"policy {text!r}: {error}") from None


def suffix(chosen: Options) -> str:
    """Settings as they stand in a policy's name."""
    return ":" + ",".join(f"{name}={value}" for name, value in chosen) if chosen else ""


def read(path: Path) -> list[str]:
    """The policies of a TOML file, by name. Raises ValueError in one line.

    [[policy]]
    base = "mujoco/tuned"
    iterations = 20
    """
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"cannot read {path}: {error.strerror}") from None
    except ValueError as error:
        raise ValueError(f"{path} is not TOML: {error}") from None
    tables = content.get("policy")
    if set(content) != {"policy"} or not isinstance(tables, list) or not tables:
        raise ValueError(f"{path}: a file of policies holds tables [[policy]] and nothing else")
    return [_named(f"{path}, policy {number}", table) for number, table in enumerate(tables, 1)]


def _named(where: str, table: Any) -> str:
    base = table.get("base") if isinstance(table, dict) else None
    if not isinstance(base, str):
        raise ValueError(f'{where}: base is missing; write base = "mujoco/tuned"')
    given = {name: value for name, value in table.items() if name != "base"}
    return base + suffix(options(where, base, given))
