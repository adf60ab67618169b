"""The replay's poster: a drawn picture of a few runs side by side at one instant, for the first screen."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from impactbench.adapters.frames import matrix
from impactbench.reports.page_data import FLOOR, percent
from impactbench.reports.replay_pack import exponential, restored, unpack
from impactbench.reports.replay_record import SERIES
from impactbench.scenarios.trajectory import Floats

WIDTH, HEIGHT, MARGIN = 160, 120, 6
SMALL = 6.0
"""Radius in the panel's units below which a thick edge would hide the ball."""
OBLIQUE = ((0.866, 0.5, 0.0), (-0.204, 0.353, 0.913))
"""Right and up of a view from above: azimuth -60 degrees, elevation 24 degrees, as the moving replay begins."""


def poster(
    case: dict[str, Any],
    contestants: list[str],
    link: Callable[[str, str, float], str],
    featured: dict[str, Any] | None = None,
) -> dict[str, Any]:
    """Panels of the contestants where two runs first part, with a sentence and links into the replay; `featured` is
    the case the page begins with, where that is another.
    """
    parted = case["apart"]
    time = parted["time"] if parted else 0.0
    names = list(dict.fromkeys([*(parted["runs"] if parted else []), *contestants]))[: max(2, len(contestants))]
    stills = [Still(case, run, time) for run in case["runs"] if run["contestant"] in names]
    view = View(case, closer(case, stills))
    panels = [
        {
            "contestant": still.contestant,
            "svg": drawing(case, still, view),
            "error": still.error,
            "link": link(case["case"], still.contestant, time) + "&close=1",
        }
        for still in stills
    ]
    instead = featured and {"case": featured["case"], **sentence(featured)}
    return {"case": case["case"], "time": time, "panels": panels, "instead": instead, **sentence(case)}


def sentence(case: dict[str, Any]) -> dict[str, Any]:
    """Who is apart, when and by how much."""
    parted = case["apart"]
    if not parted:
        return {"runs": [], "size": "", "visible": False}
    return {"runs": parted["runs"], "size": percent(parted["distance"] / case["length"]), "visible": parted["visible"]}


def share(case: dict[str, Any]) -> float:
    """How much of their own picture lies between the two runs that part."""
    if not (parted := case["apart"]):
        return 0.0
    box = closer(
        case, [Still(case, run, parted["time"]) for run in case["runs"] if run["contestant"] in parted["runs"]]
    )
    return float(parted["distance"] / math.dist(box["low"], box["high"]))


class Still:
    """One run at one instant: places [n, 3], turns [n, 4] and colour levels of its bodies, and the truth's."""

    def __init__(self, case: dict[str, Any], run: dict[str, Any], time: float) -> None:
        n, count, truth = len(case["movable"]), run["frames"], case["truths"][run["law"]]
        frame = min(round(time / case["frame"]), count - 1)
        rows = (7 if run["turning"] else 3) * n
        motion, levels, series = unpack(run["data"], (rows, count, 2), (n, count, 1), (len(SERIES), count, 1))
        self.contestant = run["contestant"]
        self.places, self.turns = _placed(motion[:, frame], run, n)
        self.levels = [int(level) for level in levels[:, frame]]
        error = float(exponential(series[SERIES.index("position_error"), frame]))
        self.error = "" if math.isnan(error) else percent(float(f"{error:.2g}") if error > FLOOR else 0.0)
        self.ghost = ghost_pose(case, truth, frame) if frame < truth["frames"] else None


def closer(case: dict[str, Any], stills: list[Still]) -> dict[str, Any]:
    """The part of the replay's box that these stills fill: bodies would be specks in the box of all times."""
    reach = np.array([[radius(case["bodies"][index])] for index in case["movable"]])
    places = [places for still in stills for places in (still.places, *(still.ghost or ())[:1])]
    low = np.min([(p - reach).min(axis=0) for p in places], axis=0)
    high = np.max([(p + reach).max(axis=0) for p in places], axis=0)
    whole = case["camera"]
    low, high = np.maximum(low, whole["low"]), np.minimum(high, whole["high"])
    return {"low": low, "high": high} if (low < high).all() else whole  # all have left the picture


def radius(body: dict[str, Any]) -> float:
    """Of a ball around a body [m]."""
    return float(np.linalg.norm(body["size"])) if body["kind"] == "box" else float(sum(body["size"]))


def drawing(case: dict[str, Any], still: Still, view: View) -> str:
    """One panel as SVG: numbers only, nothing that was named by a user."""
    shapes = [
        view.shape(body, body["position"], body["orientation"], "ground") for body in case["bodies"] if body["static"]
    ]
    for row, index in enumerate(case["movable"]):
        shapes.append(view.shape(case["bodies"][index], still.places[row], still.turns[row], f"l{still.levels[row]}"))
    if still.ghost is not None:
        places, turns = still.ghost
        shapes += [
            view.shape(case["bodies"][index], places[row], turns[row], "ghost")
            for row, index in enumerate(case["movable"])
        ]
    return f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" aria-hidden="true">{"".join(shapes)}</svg>'


def ghost_pose(case: dict[str, Any], truth: dict[str, Any], frame: int) -> tuple[Floats, Floats] | None:
    """The truth's bodies in one frame; None where it is not known."""
    n, count = len(case["movable"]), truth["frames"]
    motion, rest = unpack(truth["data"], ((7 if truth["turning"] else 3) * n, count, 2), (2, count, 1))
    return _placed(motion[:, frame], truth, n) if rest[0, frame] else None


def _placed(words: Any, track: dict[str, Any], n: int) -> tuple[Floats, Floats]:
    places = restored(words[: 3 * n].reshape(3, n).T, np.array(track["low"]), np.array(track["span"]))
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
    return places, words[3 * n :].reshape(4, n).T / 32767 if track["turning"] else upright


class View:
    """From metres to the panel: along the axis that is not in the picture, or obliquely from above."""

    def __init__(self, case: dict[str, Any], box: dict[str, Any]) -> None:
        self.flat = len(case["axes"]) < 3
        self.axes = np.eye(3)[case["picture"]] if self.flat else np.array(OBLIQUE)
        low, high = np.array(box["low"]), np.array(box["high"])
        corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T @ self.axes.T
        extent = np.ptp(corners, axis=0)
        self.scale = float(min((WIDTH - MARGIN) / extent[0], (HEIGHT - MARGIN) / extent[1]))
        self.centre = (corners.min(axis=0) + corners.max(axis=0)) / 2
        self.middle = (low + high) / 2

    def at(self, points: Floats) -> Floats:
        """Panel coordinates of points [..., 3]."""
        flat = (points @ self.axes.T - self.centre) * self.scale
        return np.asarray(flat * [1, -1] + [WIDTH / 2, HEIGHT / 2])

    def shape(self, body: dict[str, Any], place: Any, turn: Any, kind: str) -> str:
        """One body as SVG."""
        where, size = self.at(np.asarray(place, dtype=float)), body["size"]
        match body["kind"]:
            case "sphere":
                radius = size[0] * self.scale
                small = " small" if radius < SMALL else ""
                return f'<circle class="{kind}{small}" cx="{where[0]:.1f}" cy="{where[1]:.1f}" r="{radius:.1f}"/>'
            case "plane":
                return self.plane(np.array(size), np.asarray(place, dtype=float))
            case "capsule":
                ends = self.at(place + np.outer([-1, 1], matrix(tuple(turn))[:, 2] * size[1]))
                line = f"M{ends[0][0]:.1f} {ends[0][1]:.1f}L{ends[1][0]:.1f} {ends[1][1]:.1f}"
                wide = 2 * size[0] * self.scale
                return f'<path class="rod {kind}" d="{line}" stroke-width="{wide:.1f}"/>'
        signs = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T * np.array(size)
        corners = self.at(place + signs @ matrix(tuple(turn)).T)
        return f'<path class="{kind}" d="{_path(_hull(corners))}"/>'

    def plane(self, normal: Floats, place: Floats) -> str:
        """What lies behind a plane; nothing in an oblique view, where it would hide the bodies."""
        across = (self.axes @ normal) * [1, -1]
        if not self.flat or np.linalg.norm(across) < 1e-6:
            return ""
        foot = self.at(self.middle - ((self.middle - place) @ normal) * normal)
        along, far = np.array([-across[1], across[0]]), WIDTH + HEIGHT
        points = [
            foot + far * along,
            foot - far * along,
            foot - far * along - far * across,
            foot + far * along - far * across,
        ]
        return f'<path class="ground" d="{_path(np.array(points))}"/>'


def _hull(points: Floats) -> Floats:
    """Convex hull of a few points, in order round their middle (Andrew's monotone chain)."""
    ordered = sorted(map(tuple, points))

    def chain(items: Any) -> list[tuple[float, ...]]:
        found: list[tuple[float, ...]] = []
        for p in items:
            while len(found) > 1 and _turn(found[-2], found[-1], p) <= 1e-9:
                found.pop()
            found.append(p)
        return found[:-1]

    return np.array(chain(ordered) + chain(reversed(ordered)))


def _turn(o: tuple[float, ...], a: tuple[float, ...], b: tuple[float, ...]) -> float:
    return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])


def _path(points: Floats) -> str:
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points) + "Z"
