"""Seeded faults of the measures: one line of their source exchanged for another, in the process that imports this.

`impactbench check` loads a mutant as a contestant (a child measures with it); the measures' own tests load it as a
pytest plugin, `-p measure_mutants`, with the mutant's name in IMPACTBENCH_MUTANT.
"""

from __future__ import annotations

import importlib
import os
import sys
from dataclasses import dataclass
from pathlib import Path

REPORTS = "impactbench.reports"
ORDER = ("geometry", "impacts", "conservation", "measures", "cell")
"""The measures' modules, each importing names from those before it."""


@dataclass(frozen=True)
class Change:
    fault: str
    module: str
    old: str
    new: str


CHANGES = {
    "FirstBodyIgnored": Change(
        "momentum: the first body ignored", "conservation",
        'momenta = np.einsum("n,tni->ti", mass, trajectory.velocities)',
        'momenta = np.einsum("n,tni->ti", mass[1:], trajectory.velocities[:, 1:])',
    ),
    "MomentumWithoutMass": Change(
        "momentum: masses ignored", "conservation",
        'momenta = np.einsum("n,tni->ti", mass, trajectory.velocities)',
        'momenta = np.einsum("n,tni->ti", mass * 0 + 1, trajectory.velocities)',
    ),
    "MomentumMean": Change(
        "momentum and energy gain: mean in place of the largest", "measures",
        "return Figure(measure, float(series[index]),",
        "return Figure(measure, float(series.mean()),",
    ),
    "MomentumAlongZ": Change(
        "momentum: norm of one axis", "conservation",
        "drift = np.linalg.norm(np.cumsum(excess, axis=0), axis=1)",
        "drift = np.abs(np.cumsum(excess, axis=0)[:, 2])",
    ),
    "MomentumSigned": Change(
        "momentum: sign kept, so that a loss is below any budget", "conservation",
        "drift = np.linalg.norm(np.cumsum(excess, axis=0), axis=1)",
        "drift = np.cumsum(excess, axis=0).sum(axis=1)",
    ),
    "MomentumGravity": Change(
        "momentum: gravity of the wrong sign", "conservation",
        "excess = np.diff(momenta, axis=0) - mass.sum()", "excess = np.diff(momenta, axis=0) + mass.sum()",
    ),
    "WallsTakeAnything": Change(
        "momentum: a static may push in any direction", "conservation",
        "beyond = impulses - along", "beyond = impulses - impulses",
    ),
    "AngularWithoutMass": Change(
        "angular momentum: masses ignored", "conservation",
        'total = np.einsum("n,tni->ti", mass, np.cross(arms, speeds))',
        'total = np.einsum("n,tni->ti", mass * 0 + 1, np.cross(arms, speeds))',
    ),
    "PotentialSign": Change(
        "energy: potential of the wrong sign", "conservation",
        'energy -= np.einsum("n,tni,i->t"', 'energy += np.einsum("n,tni,i->t"',
    ),
    "NoPotential": Change(
        "energy: potential left out", "conservation",
        'energy -= np.einsum("n,tni,i->t"', 'energy -= 0 * np.einsum("n,tni,i->t"',
    ),
    "NoSpinEnergy": Change(
        "energy: spin left out", "conservation",
        'energy += 0.5 * np.einsum("tni,tni->t"', 'energy += 0.0 * np.einsum("tni,tni->t"',
    ),
    "TwiceKinetic": Change(
        "energy: m v^2 without the half", "conservation",
        'energy: Floats = 0.5 * np.einsum', 'energy: Floats = 1.0 * np.einsum',
    ),
    "NoOffset": Change(
        "energy: half-step offset left out", "conservation",
        "return np.asarray(offset - offset[0])", "return np.asarray(0 * offset)",
    ),
    "GainSign": Change(
        "energy gain of the wrong sign", "measures",
        "(matched - np.minimum.accumulate(matched)) / scene.energy",
        "(np.minimum.accumulate(matched) - matched) / scene.energy",
    ),
    "GainAtTheEnd": Change(
        "energy gain between start and end only", "measures",
        "(matched - np.minimum.accumulate(matched)) / scene.energy",
        "np.maximum(0.0, matched[-1:] - matched[0]) / scene.energy",
    ),
    "DriftSign": Change(
        "energy drift of the wrong sign", "measures",
        "float(matched[-1] - expected)", "float(expected - matched[-1])",
    ),
    "DepthSign": Change(
        "penetration: gap counted as depth", "measures",
        "np.maximum(-gaps.min(axis=0), 0.0)", "np.maximum(gaps.min(axis=0), 0.0)",
    ),
    "DepthMean": Change(
        "penetration: mean in place of the deepest", "measures",
        'Figure("penetration_max", float(depth[deepest]),', 'Figure("penetration_max", float(depth.mean()),',
    ),
    "LastPairIgnored": Change(
        "penetration: the last pair ignored", "measures",
        "[pair.gap for pair in pairs]", "[pair.gap for pair in pairs[: max(1, len(pairs) - 1)]]",
    ),
    "OneRadius": Change(
        "gap: one radius of two", "geometry",
        "return distance - ra - rb,", "return distance - ra,",
    ),
    "StaticsIgnored": Change(
        "pairs: statics ignored", "impacts",
        "pairs += [(a, b) for a in scene.statics for b in scene.movable]", "pairs += []",
    ),
    "InverseE": Change(
        "restitution: before over after", "impacts",
        "return float(-(impact.after @ impact.normal) / (impact.before @ impact.normal))",
        "return float(-(impact.before @ impact.normal) / (impact.after @ impact.normal))",
    ),
    "SpeedForE": Change(
        "restitution: of speeds, not of normal components", "impacts",
        "return float(-(impact.after @ impact.normal) / (impact.before @ impact.normal))",
        "return float(np.linalg.norm(impact.after) / np.linalg.norm(impact.before))",
    ),
    "ImpactAnyLaw": Change(
        "impact error: judged by the other law", "impacts",
        'if law == "doc":\n        return np.asarray(bounciness',
        'if law == "nc":\n        return np.asarray(bounciness',
    ),
    "OnlyFirstImpact": Change(
        "impact error: the first impact only", "measures",
        "max(impact_error(scene, law, impact, step) for impact in impacts)",
        "impact_error(scene, law, impacts[0], step)",
    ),
    "FirstBodyError": Change(
        "position error of the first body only", "measures",
        "return float(np.linalg.norm(vectors, axis=-1).max())",
        "return float(np.linalg.norm(vectors[:1], axis=-1).max())",
    ),
    "ErrorAlongX": Change(
        "position error along one axis", "measures",
        "return float(np.linalg.norm(vectors, axis=-1).max())", "return float(np.abs(vectors[..., 0]).max())",
    ),
    "ErrorAtStart": Change(
        "position error at the start in place of the end", "measures",
        "_distance(trajectory.positions[last], end)", "_distance(trajectory.positions[0], end)",
    ),
    "TimeSign": Change(
        "impact time: the truth added", "measures",
        "impacts[0].time - delay - truth.impact_times[0]", "impacts[0].time - delay + truth.impact_times[0]",
    ),
}  # fmt: skip


def apply(name: str) -> None:
    """Exchange the line in the loaded module. Raises LookupError where it is not found once: the list is then stale."""
    change = CHANGES[name]
    for part in ORDER:
        module = importlib.import_module(f"{REPORTS}.{part}")
        assert module.__file__
        text = Path(module.__file__).read_text(encoding="utf-8")
        if part == change.module:
            if text.count(change.old) != 1:
                raise LookupError(f"{name}: {text.count(change.old)} places in {part}.py hold {change.old!r}")
            text = text.replace(change.old, change.new)
        # Run again, in order: names that one module took from another are the new ones everywhere.
        exec(compile(text, module.__file__, "exec"), module.__dict__)


def pytest_configure() -> None:
    apply(os.environ["IMPACTBENCH_MUTANT"])


def contestants() -> None:
    """One contestant for each: the stepped reference (pymunk where spin is meant), measured wrongly."""
    sys.path.insert(0, str(Path(__file__).parent))
    from law_mutants import Planar, Reference

    def kind(name: str, base: type[Reference]) -> type[Reference]:
        def start(self: Reference, *arguments: object) -> None:
            if os.environ.get("IMPACTBENCH_MUTANT") != name:
                apply(name)
                os.environ["IMPACTBENCH_MUTANT"] = name
            base.__init__(self, *arguments)  # type: ignore[arg-type]

        return type(name, (base,), {"__init__": start})

    for name in CHANGES:
        globals()[name] = kind(name, Planar if "Spin" in name else Reference)


if "pytest" not in sys.modules:
    contestants()
