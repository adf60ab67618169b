"""A case in plain text: bodies, coefficients, truths and scales, and a sketch of the start.

The sketch cuts each body by the plane of two axes through its own centre, and shows where it is heading.
"""

from __future__ import annotations

import math
from string import ascii_uppercase

import numpy as np
from impactbench.adapters.frames import matrix
from impactbench.scenarios.records import UPRIGHT, Body, Box, Capsule, Contact, HalfSpace, Scene, Sphere
from impactbench.scenarios.trajectory import Flags, Floats
from impactbench.scenarios.truth import Case, Truth
from numpy.typing import NDArray

WIDTH, HEIGHT = 64, 21
TALL = 2.0
"""Height of a character over its width."""
MARGIN = 0.35
"""Of the movable bodies' extent, left free on every side: an arrow is up to 4 lines long."""
SHAFTS, TIPS = "-/|\\", ">^^^<vvv"
"""Of arrows, by direction in eighths of a turn from the first axis."""
NAMED_BODIES = 30
Canvas = NDArray[np.str_]


def describe(case: Case) -> str:
    """Everything a reader needs to picture the case, in at most 100 lines."""
    scene = case.scene
    return "\n\n".join([scene.name, _columns(_body_rows(scene)), _columns(_fact_rows(case)), sketch(scene)])


def _columns(rows: list[tuple[str, ...]]) -> str:
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    return "\n".join("  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in rows)


def _body_rows(scene: Scene) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = [
        ("", "body", "shape [m]", "mass [kg]", "position [m]", "velocity [m/s]", "turn", "spin [rad/s]")
    ]
    letters = {i: letter(row) for row, i in enumerate(scene.movable)}
    for i, body in list(enumerate(scene.bodies))[:NAMED_BODIES]:
        turned = "-" if body.orientation == UPRIGHT else _vector(body.orientation)
        mass = "static" if body.mass is None else f"{body.mass:.5g}"
        moving = [_vector(v) if any(v) else "-" for v in (body.velocity, body.spin)]
        rows.append(
            (letters.get(i, "#"), body.name, _shape(body), mass, _vector(body.position), moving[0], turned, moving[1])
        )
    if len(scene.bodies) > NAMED_BODIES:
        rows.append(("", f"and {len(scene.bodies) - NAMED_BODIES} more", *[""] * 6))
    return rows


def _vector(numbers: tuple[float, ...]) -> str:
    return f"({', '.join(f'{x:.5g}' for x in numbers)})"


def _shape(body: Body) -> str:
    match body.shape:
        case Sphere(radius):
            return f"sphere, radius {radius:.5g}"
        case Box(half):
            return f"box, half extents {_vector(half)}"
        case Capsule(radius, half):
            return f"capsule, radius {radius:.5g}, half length {half:.5g}"
        case HalfSpace(normal):
            return f"half-space, normal {_vector(normal)}"


def _fact_rows(case: Case) -> list[tuple[str, ...]]:
    scene, model = case.scene, case.scene.model
    axes = " ".join("xyz"[k] for k in model.axes)
    extras = [name for name in ("rotation", "gravity", "friction") if getattr(model, name)]
    gravity = _vector(scene.gravity) if any(scene.gravity) else "none"
    return [
        *((f"truth, law {law}", _truth(truth)) for law, truth in case.truths.items()),
        ("every pair" if not scene.pairs else "other pairs", _contact(scene.contact)),
        *((f"{left} and {right}", _contact(contact)) for left, right, contact in scene.pairs[:NAMED_BODIES]),
        ("smallest model", f"axes {axes}" + "".join(f", {name}" for name in extras)),
        ("gravity", f"{gravity} m/s^2" if any(scene.gravity) else gravity),
        ("duration", f"{scene.duration:.5g} s" + ("" if scene.phase_free else ", bodies touch at t = 0")),
        ("scales", f"length {scene.length:.5g} m, speed {scene.speed:.5g} m/s, energy {scene.energy:.5g} J"),
        ("1 % error means", case.headline),
    ]


def _truth(truth: Truth) -> str:
    if not truth.impact_times:
        return f"{truth.kind}, no impacts listed"
    shown = ", ".join(f"{time:.6g}" for time in truth.impact_times[:6])
    more = len(truth.impact_times) - 6
    return f"{truth.kind}, impacts at {shown} s" + (f" and {more} more" if more > 0 else "")


def _contact(contact: Contact) -> str:
    return (
        f"bounciness {contact.bounciness:.5g}, friction {contact.friction:.5g}, viscosity {contact.viscosity:.5g} kg/s"
    )


def sketch(scene: Scene) -> str:
    """Bodies as letters in scene order, statics as #, arrows along the velocities."""
    axes = picture_axes(scene)
    points, cell = _grid(scene, axes)
    canvas = np.full((HEIGHT, WIDTH), " ")
    for i in scene.statics:
        canvas[_covered(scene.bodies[i], points, axes)] = "#"
    for row, i in enumerate(scene.movable):
        body = scene.bodies[i]
        canvas[_covered(body, points, axes)] = letter(row)
        canvas[_centre(body, points, axes)] = letter(row)
    for i in scene.movable:
        _draw_arrow(canvas, scene, scene.bodies[i], points, axes, cell)
    across, up = ("xyz"[k] for k in axes)
    scale = f"{across} to the right, {up} up; a column is {cell:.3g} m wide, a line {TALL * cell:.3g} m high"
    lines = ["".join(row).rstrip() for row in canvas]
    return "\n".join([*lines, scale])


def letter(row: int) -> str:
    return ascii_uppercase[row % len(ascii_uppercase)]


def picture_axes(scene: Scene) -> tuple[int, int]:
    """The two axes along which places, motion and gravity spread most, ascending; z joins where one axis is enough."""
    bodies = [scene.bodies[i] for i in scene.movable]
    places = np.array([body.position for body in bodies])
    reach = np.array([body.velocity for body in bodies]) * scene.duration
    spread = np.ptp(places, axis=0) + np.abs(reach).max(axis=0)
    spread += np.abs(np.array(scene.gravity)) * scene.duration**2 / 2
    ranked = sorted(range(3), key=lambda k: (-spread[k], k != 2, k))
    first, second = sorted(ranked[:2])
    return first, second


def _grid(scene: Scene, axes: tuple[int, int]) -> tuple[Floats, float]:
    """World points of the characters' middles, shape [HEIGHT, WIDTH, 2], and the width of a column [m]."""
    marks = [mark for body in scene.bodies for mark in _marks(scene, body)]
    places = np.array([[place[k] for k in axes] for place, _ in marks])
    sizes = np.array([[size] for _, size in marks])
    low, high = (places - sizes).min(axis=0), (places + sizes).max(axis=0)
    extent = (high - low) * (1 + 2 * MARGIN)
    cell = max(extent[0] / WIDTH, extent[1] / (TALL * HEIGHT))
    columns = (np.arange(WIDTH) - (WIDTH - 1) / 2) * cell
    rows = -(np.arange(HEIGHT) - (HEIGHT - 1) / 2) * TALL * cell
    right, up = np.meshgrid(columns, rows)
    return np.stack([right, up], axis=-1) + (low + high) / 2, float(cell)


def _marks(scene: Scene, body: Body) -> list[tuple[Floats, float]]:
    """Points that must be in the picture, with the room around them [m]; of a plane, what is nearest to the bodies."""
    place = np.array(body.position)
    if not isinstance(body.shape, HalfSpace):
        return [(place, _size(body))]
    normal = np.array(body.shape.normal)
    centres = [np.array(scene.bodies[i].position) for i in scene.movable]
    return [(centre - normal * ((centre - place) @ normal), 0.0) for centre in centres]


def _size(body: Body) -> float:
    match body.shape:
        case Sphere(radius):
            return radius
        case Box(half):
            return math.hypot(*half)
        case Capsule(radius, half_length):
            return radius + half_length
        case HalfSpace():
            return 0.0


def _covered(body: Body, points: Floats, axes: tuple[int, int]) -> Flags:
    """Characters whose middle lies in the body, cut through its centre."""
    gaps = np.zeros((*points.shape[:2], 3))
    gaps[..., axes] = points - np.array([body.position[k] for k in axes])
    own = gaps @ matrix(body.orientation)
    match body.shape:
        case Sphere(radius):
            inside = np.linalg.norm(own, axis=-1) <= radius
        case Box(half):
            inside = (np.abs(own) <= np.array(half)).all(axis=-1)
        case Capsule(radius, half_length):
            own[..., 2] -= np.clip(own[..., 2], -half_length, half_length)
            inside = np.linalg.norm(own, axis=-1) <= radius
        case HalfSpace(normal):
            seen = any(abs(normal[k]) > 1e-9 for k in axes)
            inside = (gaps @ np.array(normal) <= 0) & seen
    return np.asarray(inside, dtype=np.bool_)


def _centre(body: Body, points: Floats, axes: tuple[int, int]) -> tuple[int, int]:
    return _character(np.array([body.position[k] for k in axes]), points)


def _character(place: Floats, points: Floats) -> tuple[int, int]:
    row, column = np.unravel_index(np.linalg.norm(points - place, axis=-1).argmin(), points.shape[:2])
    return int(row), int(column)


def _draw_arrow(canvas: Canvas, scene: Scene, body: Body, points: Floats, axes: tuple[int, int], cell: float) -> None:
    """From the body's edge, as long as the velocity next to the scene's fastest body."""
    velocity = np.array([body.velocity[k] for k in axes])
    fastest = max(math.hypot(*scene.bodies[i].velocity) for i in scene.movable)
    speed = float(np.linalg.norm(velocity))
    if not speed or speed <= 1e-3 * fastest:
        return
    heading = velocity / speed
    place = np.array([body.position[k] for k in axes]) + (cell * heading)
    for _ in range(WIDTH + HEIGHT):  # to the edge: it is at most the picture away
        if not _covered(body, place[None, None], axes)[0, 0]:
            break
        place = place + cell * heading
    length = cell * (2 + 5 * speed / fastest)
    eighth = round(math.atan2(heading[1], heading[0]) / (math.pi / 4)) % 8
    _put(canvas, place + length * heading, points, cell, TIPS[eighth])
    for part in np.arange(0.0, length, cell / 2):
        _put(canvas, place + part * heading, points, cell, SHAFTS[eighth % 4])


def _put(canvas: Canvas, place: Floats, points: Floats, cell: float, mark: str) -> None:
    row, column = _character(place, points)
    if np.all(np.abs(points[row, column] - place) <= np.array([cell, TALL * cell])) and canvas[row, column] in " #":
        canvas[row, column] = mark
