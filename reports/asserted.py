"""Runs of other projects, measured as the harness measures its own: what the `conservation` fixture does."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping, Sequence

import numpy as np
import pytest
from impactbench.reports.cell import record, step_count, step_seconds
from impactbench.reports.measures import UNITS, measure
from impactbench.scenarios import catalogue, scene_defaults, scene_file
from impactbench.scenarios.engine import Engine, Unsupported
from impactbench.scenarios.records import UPRIGHT, Body, Contact, HalfSpace, Law, Scene, Sphere, Vector
from impactbench.scenarios.trajectory import Flags, Floats, Trajectory
from impactbench.scenarios.truth import Case
from numpy.typing import ArrayLike

MEASURES = (
    *("momentum_drift", "angular_momentum_drift", "energy_gain", "energy_loss", "energy_drift", "energy_drift_raw"),
    *("penetration_max", "penetration_rms", "penetration_final"),
    *("restitution_error", "impact_velocity_error", "impact_time_error"),
    *("position_error", "velocity_error", "spin_error", "trajectory_error"),
)
"""What a budget may name. A budget bounds the figure's size, whatever its sign."""

Plane = tuple[Sequence[float], Sequence[float]]


class Conservation:
    """What one test was given to measure. `budgets` are those of its markers; a call's own win over them.

    Figures and budgets are appended to `properties`, which pytest writes into its JUnit file.
    """

    def __init__(self, budgets: Mapping[str, float], properties: list[tuple[str, object]]) -> None:
        self._budgets = _valid(budgets)
        self._properties = properties
        self.runs: list[dict[str, float]] = []
        self.asked = False
        """Whether a run was given at all, measured or not."""

    def run(
        self,
        times: ArrayLike,
        positions: ArrayLike,
        velocities: ArrayLike,
        *,
        masses: Sequence[float] | None = None,
        radii: Sequence[float] | None = None,
        planes: Sequence[Plane] = (),
        gravity: Sequence[float] = (0.0, 0.0, 0.0),
        restitution: float = 1.0,
        friction: float = 0.0,
        orientations: ArrayLike | None = None,
        spins: ArrayLike | None = None,
        inertias: Sequence[Sequence[float]] | None = None,
        scene: Scene | str | None = None,
        name: str = "",
        **budgets: float,
    ) -> dict[str, float]:
        """Measure one run and fail the test if a budget is exceeded; returns all figures by name.

        times [s], shape [T]; positions [m] and velocities [m/s] of the movable bodies, shape [T, n, 3] (or [T, n, 2]:
        the third axis is 0); masses [kg], shape [n]. With `radii` [m] the bodies are balls that meet one another and
        the `planes`, each a point and the normal of its free side. `gravity` [m/s^2]. `restitution` and `friction`
        say what the contacts are meant to do (Newton, Coulomb). Bodies that turn have orientations (w, x, y, z), shape
        [T, n, 4], spins [rad/s], shape [T, n, 3], both in world axes, and principal moments `inertias` [kg m^2], shape
        [n, 3] (none: solid balls). Other shapes: give the whole `scene`, a record, a case's name or a scene file,
        in place of masses and all that follows. Raises ValueError for what does not fit together.
        """
        self.asked = True
        limits = self._limits(budgets)
        trajectory = _trajectory(times, positions, velocities, orientations, spins)
        if scene is not None:
            if masses is not None or radii is not None:
                raise ValueError("a run takes either `scene` or `masses` with `radii` and `planes`, not both")
            case = _case(scene)
        else:
            whole = _scene(trajectory, masses, radii, planes, gravity, inertias, Contact(restitution, friction))
            case = scene_file.case_of(whole)
        law: Law = "nc" if "nc" in case.scene.laws else "doc"
        return self._judge(case, law, trajectory, name, limits)

    def engine(
        self,
        engine: type[Engine],
        case: Scene | str,
        *,
        step: str | float = "1/240",
        profile: str = "default",
        law: Law | None = None,
        name: str = "",
        **budgets: float,
    ) -> dict[str, float]:
        """Run an engine class (`impactbench.scenarios.engine.Engine`) on a scene and measure that.

        `case` is a scene, a catalogue's case or a scene file. The engine runs in this process. What it declares
        Unsupported skips the test with its reason. Raises ValueError for a case or step that there is not.
        """
        self.asked = True
        limits = self._limits(budgets)
        found = _case(case)
        scene, seconds = found.scene, step_seconds(str(step))
        chosen: Law = law or ("nc" if "nc" in scene.laws else scene.laws[0])
        if chosen not in scene.laws:
            raise ValueError(f"{scene.name} has no meaning under the law {chosen!r}: {', '.join(scene.laws)}")
        try:
            world = engine(scene, chosen, profile, scene.model, seconds)
        except Unsupported as why:
            pytest.skip(f"{engine.__name__} does not support {scene.name}: {why}")
        try:
            trajectory = record(world, seconds, step_count(scene, seconds))
        except Unsupported as why:
            pytest.skip(f"{engine.__name__} does not support {scene.name}: {why}")
        finally:
            world.close()
        return self._judge(found, chosen, trajectory, name or (scene.name if self.runs else ""), limits)

    def _limits(self, budgets: Mapping[str, float]) -> dict[str, float]:
        limits = self._budgets | _valid(budgets)
        if not limits:
            raise ValueError("no budget is stated: give one here or by @pytest.mark.conservation(momentum_drift=1e-12)")
        return limits

    def _judge(
        self, case: Case, law: Law, trajectory: Trajectory, name: str, limits: dict[str, float]
    ) -> dict[str, float]:
        label = name or (f"run {len(self.runs) + 1}" if self.runs else "")
        if not trajectory.finite():
            self.runs.append({})
            bad = np.flatnonzero(~_finite_steps(trajectory))[0]
            pytest.fail(f"{label or case.scene.name}: not finite at t = {trajectory.times[bad]:.6g} s", pytrace=False)
        with np.errstate(over="ignore", invalid="ignore"):
            figures = {figure.measure: figure.value for figure in measure(case, law, trajectory)}
        if "energy_drift" in figures:
            figures.setdefault("energy_loss", max(0.0, -figures["energy_drift"]))
        self.runs.append(figures)
        prefix = f"impactbench.{label}." if label else "impactbench."
        self._properties += [(prefix + key, value) for key, value in figures.items()]
        self._properties += [(f"{prefix}{key}.budget", limit) for key, limit in limits.items()]
        if problems := [text for key, limit in limits.items() if (text := _problem(key, figures.get(key), limit))]:
            where = f"{label or case.scene.name} ({len(trajectory.times) - 1} steps, law {law})"
            pytest.fail("\n".join([f"not conserved in {where}:", *problems]), pytrace=False)
        return figures


def _problem(key: str, value: float | None, limit: float) -> str:
    if value is None:
        return f"  {key}: cannot be measured in this scene, yet a budget is stated for it"
    if abs(value) <= limit:  # False for NaN
        return ""
    unit = UNITS.get(key, "")
    return f"  {key}: {value:.6g}{unit and ' ' + unit} is beyond its budget {limit:g}"


def _valid(budgets: Mapping[str, float]) -> dict[str, float]:
    for key, limit in budgets.items():
        if key not in MEASURES:
            near = difflib.get_close_matches(key, MEASURES, 1)
            hint = f"did you mean {near[0]}? " if near else ""
            raise ValueError(f"no budget is named {key!r}; {hint}known: {', '.join(MEASURES)}")
        if isinstance(limit, bool) or not isinstance(limit, (int, float)) or not 0 <= limit < math.inf:
            raise ValueError(f"the budget {key} must be a finite number from 0 on, got {limit!r}")
    return dict(budgets)


def _case(what: Scene | str) -> Case:
    if isinstance(what, Scene):
        return scene_file.case_of(what)
    cases = catalogue.select([what])
    if len(cases) != 1:
        names = ", ".join(case.scene.name for case in cases[:4])
        raise ValueError(f"{what!r} names {len(cases)} cases ({names}, ...); name one")
    return cases[0]


def _trajectory(
    times: ArrayLike,
    positions: ArrayLike,
    velocities: ArrayLike,
    orientations: ArrayLike | None,
    spins: ArrayLike | None,
) -> Trajectory:
    t = np.asarray(times, dtype=float)
    if t.ndim != 1 or len(t) < 2 or not (np.diff(t) > 0).all():
        raise ValueError("times must be at least two ascending numbers, shape [T]")
    x, v = _vectors("positions", positions, len(t)), _vectors("velocities", velocities, len(t))
    if x.shape != v.shape:
        raise ValueError(f"positions and velocities must have one shape, got {x.shape} and {v.shape}")
    if (orientations is None) != (spins is None):
        raise ValueError("orientations and spins belong together: give both or neither")
    if orientations is None or spins is None:
        return Trajectory(t - t[0], x, v)
    q, w = np.asarray(orientations, dtype=float), np.asarray(spins, dtype=float)
    if q.shape != (*x.shape[:2], 4) or w.shape != x.shape:
        raise ValueError(
            f"orientations must have shape {(*x.shape[:2], 4)}, spins {x.shape}, got {q.shape} and {w.shape}"
        )
    return Trajectory(t - t[0], x, v, q, w)


def _vectors(what: str, values: ArrayLike, count: int) -> Floats:
    array = np.asarray(values, dtype=float)
    if array.ndim != 3 or array.shape[0] != count or array.shape[1] == 0 or array.shape[2] not in (2, 3):
        raise ValueError(f"{what} must have shape [T, n, 3] or [T, n, 2] with T = {count}, got {list(array.shape)}")
    return np.concatenate([array, np.zeros((*array.shape[:2], 1))], axis=2) if array.shape[2] == 2 else array


def _scene(
    trajectory: Trajectory,
    masses: Sequence[float] | None,
    radii: Sequence[float] | None,
    planes: Sequence[Plane],
    gravity: Sequence[float],
    inertias: Sequence[Sequence[float]] | None,
    contact: Contact,
) -> Scene:
    """The scene of balls and planes that these numbers describe, its scales worked out as for a scene file."""
    count = trajectory.positions.shape[1]
    weights = _positive("masses", masses, count)
    sizes = _positive("radii", radii, count) if radii is not None else [0.0] * count
    if radii is None and planes:
        raise ValueError("bodies that meet planes need `radii`")
    first = trajectory.state(0)
    turns, spins = first.orientations, first.spins
    if spins is not None and radii is None and inertias is None:
        raise ValueError("bodies that turn need `inertias`, or `radii` as solid balls")
    bodies = [
        Body(
            f"body {i}",
            Sphere(sizes[i]),
            weights[i],
            _vector("positions", first.positions[i]),
            _vector("velocities", first.velocities[i]),
            UPRIGHT if turns is None else tuple(map(float, turns[i])),  # type: ignore[arg-type]
            (0.0, 0.0, 0.0) if spins is None else _vector("spins", spins[i]),
            None if inertias is None else _vector("inertias", inertias[i]),
        )
        for i in range(count)
    ]
    for k, (point, normal) in enumerate(planes):
        way = np.array(_vector("a plane's normal", normal))
        if not np.linalg.norm(way) > 0:
            raise ValueError(f"the normal of plane {k} is zero")
        bodies.append(
            Body(
                f"plane {k}",
                HalfSpace(_vector("", way / np.linalg.norm(way))),
                None,
                _vector("a plane's point", point),
            )
        )
    content = scene_defaults.Content(
        tuple(bodies), _vector("gravity", gravity), float(trajectory.times[-1]), (contact,)
    )
    # A single point has no extent of its own: then the way it went.
    extent = float(np.ptp(trajectory.positions, axis=0).max()) or 1.0
    length, speed, energy = scene_defaults.scales(content)
    speed = speed or extent / content.duration
    return Scene(
        "run",
        content.bodies,
        content.duration,
        scene_defaults.model(content, None, spins is not None),
        length or extent,
        speed,
        energy or sum(weights) * speed**2 / 2,
        content.gravity,
        contact,
        laws=("nc",),
        collide=radii is not None,
    )


def _positive(what: str, values: Sequence[float] | None, count: int) -> list[float]:
    numbers = [] if values is None else [float(value) for value in values]
    if len(numbers) != count or not all(math.isfinite(value) and value > 0 for value in numbers):
        raise ValueError(f"{what} must be {count} positive numbers, one for each movable body")
    return numbers


def _vector(what: str, values: Sequence[float] | Floats) -> Vector:
    numbers = [float(value) for value in values]
    if len(numbers) == 2:
        numbers.append(0.0)
    if len(numbers) != 3:
        raise ValueError(f"{what} must have three components, got {len(numbers)}")
    x, y, z = numbers
    return (x, y, z)


def _finite_steps(trajectory: Trajectory) -> Flags:
    parts = (trajectory.positions, trajectory.velocities, trajectory.orientations, trajectory.spins)
    fine = [np.isfinite(part).all(axis=(1, 2)) for part in parts if part is not None]
    return np.asarray(np.all(fine, axis=0))
