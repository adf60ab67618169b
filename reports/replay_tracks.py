"""Tracks: recorded motion quantised and packed for the page, with what is drawn around it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from impactbench.reports.cell import Cell
from impactbench.reports.conservation import energies
from impactbench.reports.measures import expected_energy
from impactbench.reports.picture import picture_axes
from impactbench.reports.replay_pack import Words, logarithmic, pack, quantised
from impactbench.reports.replay_record import SERIES, largest_of, start_of
from impactbench.scenarios.records import Body, Box, Capsule, HalfSpace, Law, Scene, Sphere
from impactbench.scenarios.trajectory import Floats
from impactbench.scenarios.truth import Case, Truth
from numpy.typing import NDArray

FRAMES_PER_SECOND = 60
MOST_FRAMES = 600
MOST_WORDS = 1_000_000
"""Bodies, times frames, times coordinates of one run: 2 MB before compression."""
FARTHEST = 30
"""Lengths of the scene: a run that flies off is drawn no farther, else its box would blur what happened before."""
VISIBLE = 0.06
"""Of the picture's diagonal: some 12 pixels of a panel's 200."""
Recording = dict[str, Any]


def every(scene: Scene, step: float) -> int:
    """Steps from one drawn frame to the next."""
    coordinates = len(scene.movable) * (7 if scene.model.rotation else 3)
    most = max(2, min(MOST_FRAMES, MOST_WORDS // coordinates))
    return max(1, math.ceil(1 / (FRAMES_PER_SECOND * step) - 1e-9), math.ceil(scene.duration / step / most))


def packed_case(case: Case, runs: list[Recording], silent: list[dict[str, str]], thin: int) -> Recording:
    """One case with its truths and runs, at every `thin`-th recorded frame."""
    scene, cell = case.scene, runs[0]["cell"]
    frame = every(scene, cell.step_seconds) * cell.step_seconds * thin
    count = max(len(run["positions"][::thin]) for run in runs)
    laws = dict.fromkeys(run["cell"].law for run in runs)
    truths = {law: truth_track(scene, law, case.truths[law], frame, count) for law in laws}
    healthy = [run["positions"] for run in runs if run["state"] == "ok"]
    known = [track.pop("places") for track in truths.values()]
    box = camera(scene, healthy, known)
    return {
        "case": scene.name,
        "step_text": cell.step,
        "frame": frame,
        "frames": count,
        "duration": scene.duration,
        "length": scene.length,
        "axes": list(scene.model.axes),
        "picture": list(picture_axes(scene)),
        "camera": box,
        "apart": apart(runs, frame / thin, float(np.linalg.norm(np.subtract(box["high"], box["low"])))),
        "bodies": [drawn(body) for body in scene.bodies],
        "movable": list(scene.movable),
        "truths": truths,
        "runs": [run_track(scene, run, thin) for run in runs],
        "not_recorded": silent,
    }


def drawn(body: Body) -> dict[str, Any]:
    """A body as the page draws it: kind and sizes [m]; statics with their place."""
    match body.shape:
        case Sphere(radius):
            shape: dict[str, Any] = {"kind": "sphere", "size": [radius]}
        case Box(half):
            shape = {"kind": "box", "size": list(half)}
        case Capsule(radius, half_length):
            shape = {"kind": "capsule", "size": [radius, half_length]}
        case HalfSpace(normal):
            shape = {"kind": "plane", "size": list(normal)}
    place = {"position": list(body.position), "orientation": list(body.orientation)} if body.static else {}
    return {"name": body.name, "static": body.static, **shape, **place}


def camera(scene: Scene, runs: list[Floats], truths: list[Floats]) -> dict[str, list[float]]:
    """The box to look at [m]: start and truths whole, healthy runs up to half as far again, so that one run that flies
    off does not shrink all others.
    """
    sure = np.concatenate([start_of(scene).positions[0], *[places.reshape(-1, 3) for places in truths]])
    low, high = sure.min(axis=0), sure.max(axis=0)
    reach = max(float((high - low).max()), scene.length) / 2
    for places in runs:
        flat = places.reshape(-1, 3)
        low, high = np.minimum(low, flat.min(axis=0)), np.maximum(high, flat.max(axis=0))
    low, high = np.maximum(low, sure.min(axis=0) - reach), np.minimum(high, sure.max(axis=0) + reach)
    margin = max(_extent(scene.bodies[i]) for i in scene.movable)
    return {"low": rounded(low - margin), "high": rounded(high + margin)}


def apart(runs: list[Recording], frame: float, picture: float) -> dict[str, Any] | None:
    """When two runs of one law first differ by what the eye sees, else when they differ most; `picture` is its
    diagonal [m]. None without two such runs. Runs of different laws differ rightly.
    """
    best: dict[str, Any] | None = None
    for k, run in enumerate(runs):
        for other in runs[:k]:
            if run["cell"].law != other["cell"].law:
                continue
            count = min(len(run["positions"]), len(other["positions"]))
            away = np.linalg.norm(run["positions"][:count] - other["positions"][:count], axis=2).max(axis=1)
            seen = bool(away.max() > VISIBLE * picture)
            at = int(np.argmax(away > VISIBLE * picture)) if seen else int(away.argmax())
            names = [other["cell"].contestant, run["cell"].contestant]
            found = {"time": at * frame, "distance": float(away[at]), "visible": seen, "runs": names}
            if best is None or _sooner(found, best):
                best = found
    return best


def _sooner(found: dict[str, Any], best: dict[str, Any]) -> bool:
    """Whether a pair comes apart before another; one that is seen to counts before one that is not."""
    if found["visible"] != best["visible"]:
        return bool(found["visible"])
    return bool(found["time"] < best["time"] if found["visible"] else found["distance"] > best["distance"])


def _extent(body: Body) -> float:
    match body.shape:
        case Box(half):
            return math.hypot(*half)
        case Capsule(radius, half_length):
            return radius + half_length
        case Sphere(radius):
            return radius
        case _:
            return 0.0


def rounded(values: Floats) -> list[float]:
    """Twelve digits: the page's script must restore what is meant."""
    return [float(f"{value:.12g}") for value in values]


def in_rows(values: NDArray[Any]) -> NDArray[Any]:
    """[T, n, k] as rows over time [k * n, T], coordinate by coordinate."""
    return np.moveaxis(values, 0, -1).swapaxes(0, 1).reshape(-1, len(values))


def turns(orientations: Floats) -> Words:
    """Quaternions as words, without the jumps that q and -q, one turn, may make."""
    flips = np.where((orientations[1:] * orientations[:-1]).sum(axis=-1) < 0, -1.0, 1.0)
    signs = np.concatenate([np.ones((1, orientations.shape[1])), np.cumprod(flips, axis=0)])
    return np.asarray(np.rint(orientations * signs[..., None] * 32767), dtype=np.int16)


def motion(places: Floats, orientations: Floats | None, scene: Scene) -> tuple[dict[str, Any], Words]:
    """Header of a track and its words [rows, T]: positions, then quaternions."""
    start = start_of(scene).positions[0]
    reach = FARTHEST * scene.length
    places = np.clip(places, start.min(axis=0) - reach, start.max(axis=0) + reach)
    flat, least = places.reshape(-1, 3), 1e-6 * scene.length
    low = np.array(rounded(flat.min(axis=0) - least))
    span = np.array(rounded(flat.max(axis=0) - low + least))
    words = in_rows(quantised(places, low, span))
    if orientations is not None:
        words = np.concatenate([words, in_rows(turns(orientations))])
    header = {"frames": len(places), "turning": orientations is not None, "low": rounded(low), "span": rounded(span)}
    return header | {"loss": float(f"{span.max() / 131068:.2g}")}, words


def truth_track(scene: Scene, law: Law, truth: Truth, frame: float, count: int) -> dict[str, Any]:
    """The truth over frames; where nothing is known the bodies stay and the row `known` says 0."""
    start = start_of(scene)
    first = float(energies(scene, start)[0])
    places, rotations, known, energy = [start.positions[0]], [start.orientations], [1.0], [0.0]
    for k in range(1, count):
        state = truth.state(k * frame)
        left = expected_energy(scene, law, truth, k * frame, start)
        energy.append(math.nan if left is None else (left - first) / scene.energy)
        known.append(0.0 if state is None else 1.0)
        places.append(places[-1] if state is None else state.positions)
        turn = None if state is None or state.orientations is None else state.orientations[None]
        rotations.append(rotations[-1] if turn is None else turn)
    turning = start.orientations is not None
    turned = np.concatenate([r for r in rotations if r is not None]) if turning else None
    header, words = motion(np.array(places), turned, scene)
    rest = np.stack([np.array(known).astype(np.int16), logarithmic(np.array(energy))])
    return header | {"data": pack((words, 2), (rest, 1)), "places": np.array(places), "kind": truth.kind}


def run_track(scene: Scene, run: Recording, thin: int) -> dict[str, Any]:
    """One run: motion, colour levels and series, thinned; its numbers as they are."""
    cell: Cell = run["cell"]
    positions, orientations = run["positions"][::thin], run["orientations"]
    header, words = motion(positions, None if orientations is None else orientations[::thin], scene)
    series = np.stack([logarithmic(thinned(run["series"][name], thin)) for name in SERIES])
    colours = np.ascontiguousarray(run["levels"][::thin].T).astype(np.int16)
    return {
        "contestant": cell.contestant,
        "law": cell.law,
        "model": cell.model,
        "step_text": "no step" if run["stepless"] else cell.step,
        "state": run["state"],
        **header,
        **{name: run[name] for name in ("contacts", "contact_count", "events", "summary")},
        "data": pack((words, 2), (colours, 1), (series, 1)),
    }


def thinned(series: Floats, thin: int) -> Floats:
    """Every `thin`-th value, each the largest since the one before."""
    return largest_of(series, thin) if thin > 1 else series
