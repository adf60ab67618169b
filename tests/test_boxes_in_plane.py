"""Boxes and capsules on boxes in a plane: gaps against distances of outlines, what swapping and mirroring change.

Distances come from points on the outlines themselves: two convex outlines are apart by the least distance of a corner
of one to a side of the other, and overlap by the least way along a normal of a side that parts them.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from impactbench.reference.features import room
from impactbench.reference.rigid_body import rotation
from impactbench.reference.rigid_contacts import find
from impactbench.reference.solids import SPACE, build_solids
from impactbench.scenarios.records import Body, Box, Capsule, Model, Scene

PLANAR = Model((0, 2), rotation=True)
ROUND = 1e-12  # some hundred eps of the sizes below


def turned(angle: float) -> tuple[float, float, float, float]:
    return (math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0)


def box(x: float, z: float, angle: float, a=0.5, c=0.3) -> Body:
    return Body(f"{x}", Box((a, 0.4, c)), 1.0, (x, 0.0, z), orientation=turned(angle))


def features(a: Body, b: Body) -> list[tuple[int, float, np.ndarray, np.ndarray]]:
    solids, found = build_solids(Scene("test", (a, b), 1.0, PLANAR, 1.0, 1.0, 1.0), 1), room()
    count = find(solids, 0, 1, found)
    return [(int(found.number[f]), found.gap[f], found.normal[f].copy(), found.point[f].copy()) for f in range(count)]


def outline(body: Body) -> np.ndarray:
    """Corners (x, z) in order, by the body's own angle."""
    angle = 2 * math.atan2(body.orientation[2], body.orientation[0])
    (a, _, c), (x, _, z) = body.shape.half_extents, body.position
    own = np.array([[a, c], [-a, c], [-a, -c], [a, -c]])
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    return own @ turn.T + (x, z)


def to_segment(p: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    s = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    return float(np.linalg.norm(a + s * (b - a) - p))


def distance(p: np.ndarray, q: np.ndarray) -> float:
    """Of two outlines that are apart."""
    pairs = [(c, o[k - 1], o[k]) for o, corners in ((p, q), (q, p)) for k in range(4) for c in corners]
    return min(to_segment(*pair) for pair in pairs)


def room_along_normals(p: np.ndarray, q: np.ndarray) -> float:
    """The most room between both outlines along the normal of a side; negative: the least way out of an overlap."""
    most = -math.inf
    for o in (p, q):
        for k in range(4):
            side = o[k] - o[k - 1]
            for n in (np.array([side[1], -side[0]]), np.array([-side[1], side[0]])):
                unit = n / np.linalg.norm(n)
                most = max(most, float((q @ unit).min() - (p @ unit).max()))
    return most


place, angles, sizes = st.floats(-1.2, 1.2), st.floats(-math.pi, math.pi), st.floats(0.1, 1.0)
poses = st.tuples(place, place, angles, angles, sizes, sizes)


def couple(pose) -> tuple[Body, Body]:
    x, z, first, second, a, c = pose
    return box(0.0, 0.0, first), box(x, z, second, a, c)


@given(poses)
@settings(max_examples=200, deadline=None)
def test_the_least_gap_is_the_distance_or_the_least_way_out(pose):
    a, b = couple(pose)
    p, q = outline(a), outline(b)
    gap = min(each[1] for each in features(a, b))
    assert gap >= room_along_normals(p, q) - ROUND
    if room_along_normals(p, q) > ROUND:  # apart: never more than the distance, and positive
        assert gap > 0
        corners = min(np.linalg.norm(c - d) for c, d in product(p, q))
        if distance(p, q) < corners - 1e-9:  # a corner faces a side
            assert gap == pytest.approx(distance(p, q), abs=ROUND)
    elif room_along_normals(p, q) < -ROUND:
        assert gap == pytest.approx(room_along_normals(p, q), abs=ROUND)


@given(poses, st.floats(0, 2 * math.pi))
@settings(max_examples=100, deadline=None)
def test_the_sign_of_the_gap_changes_where_the_boxes_touch_and_it_does_so_steadily(pose, towards):
    """Along any way out of an overlap the gap moves by no more than the way, once the boxes overlap or nearly touch."""
    a, b = couple((0.0, 0.0, *pose[2:]))
    gaps = []
    for s in np.linspace(0.0, 2.5, 2001):
        moved = Body("b", b.shape, 1.0, (s * math.cos(towards), 0.0, s * math.sin(towards)), orientation=b.orientation)
        gaps.append(min(each[1] for each in features(a, moved)))
    gaps = np.array(gaps)
    assert gaps[0] < 0 < gaps[-1]
    assert (np.diff(np.sign(gaps)) != 0).sum() <= 2  # once, or through an exact 0
    near = gaps[:-1] < 0
    assert np.abs(np.diff(gaps))[near].max() <= 2.5 / 2000 * (1 + 1e-9)


@given(poses)
@settings(max_examples=100, deadline=None)
def test_swapping_and_mirroring_change_only_the_sides(pose):
    a, b = couple(pose)
    found, swapped = features(a, b), features(b, a)
    gaps = sorted(each[1] for each in found)
    assert sorted(each[1] for each in swapped) == pytest.approx(gaps, abs=ROUND)

    def mirrored(body: Body) -> Body:
        (w, _, y, _), (x, _, z) = body.orientation, body.position
        return Body(body.name, body.shape, 1.0, (-x, 0.0, z), orientation=(w, 0.0, -y, 0.0))

    image = features(mirrored(a), mirrored(b))
    assert sorted(each[1] for each in image) == pytest.approx(gaps, abs=ROUND)
    if len({each[0] for each in found}) == len({each[0] for each in swapped}) == len(gaps):
        first, other = min(found, key=lambda f: f[1]), min(swapped, key=lambda f: f[1])
        if len(gaps) == 1 or gaps[1] - gaps[0] > 1e-6:
            assert first[2] @ other[2] == pytest.approx(-1.0, abs=1e-6) or first[1] > 0
            assert np.abs(first[3] - other[3]).max() <= 1e-6 or first[1] > 0


def test_a_box_on_a_box_has_a_point_at_either_end_of_the_common_face():
    low, high = box(0.0, 0.0, 0.0), box(0.3, 0.6, 0.0)
    found = sorted(features(low, high), key=lambda f: f[3][0])
    assert [f[1] for f in found] == pytest.approx([0.0, 0.0], abs=1e-15)
    assert np.array([f[3] for f in found]) == pytest.approx(np.array([[-0.2, 0.0, 0.3], [0.5, 0.0, 0.3]]))
    for f in found:
        assert f[2] == pytest.approx([0.0, 0.0, 1.0])


@pytest.mark.parametrize("lean", [0.0, 1e-16, -1e-16, 1e-13, -1e-13, 1e-6, -1e-6])
@pytest.mark.parametrize("aside", [0.0, 1e-16, -1e-16, 1e-13])
def test_equal_boxes_in_a_column_keep_their_contacts_whatever_round_off_does(lean, aside):
    # Leaning by t, and shifted by c t: its lower corners stay where they are, but for a t^2/2.
    expected = {f[0] for f in features(box(0.0, 0.0, 0.0), box(0.0, 0.6, 0.0))}
    found = {f[0] for f in features(box(0.0, 0.0, 0.0), box(aside + 0.3 * lean, 0.6, lean))}
    assert found == expected
    assert max(expected) < 4  # A's corners, whichever box holds the parting face


def test_a_box_that_rocks_on_a_corner_keeps_that_contact():
    numbers = set()
    for lean in np.linspace(0.001, 0.7, 50):
        corner = np.array([0.5 * math.cos(lean) - 0.3 * math.sin(lean), 0.5 * math.sin(lean) + 0.3 * math.cos(lean)])
        # The upper box's lower right corner stays at (0.2, 0.5) on a wide lower box.
        found = features(box(0.0, 0.0, 0.0, a=2.0, c=0.5), box(0.2 - corner[0], 0.5 + corner[1], lean))
        nearest = min(found, key=lambda f: f[1])
        assert nearest[1] == pytest.approx(0.0, abs=ROUND)
        numbers.add(nearest[0])
    assert len(numbers) == 1


# Capsules on boxes


def capsule(x: float, z: float, angle: float, radius=0.2, half=0.5) -> Body:
    return Body("capsule", Capsule(radius, half), 1.0, (x, 0.0, z), orientation=turned(angle))


def line(body: Body) -> tuple[np.ndarray, np.ndarray]:
    angle = 2 * math.atan2(body.orientation[2], body.orientation[0])
    along = body.shape.half_length * np.array([math.sin(angle), math.cos(angle)])
    centre = np.array([body.position[0], body.position[2]])
    return centre - along, centre + along


@given(st.tuples(st.floats(-2, 2), st.floats(-2, 2), angles, angles))
@settings(max_examples=200, deadline=None)
def test_a_capsules_gap_is_its_lines_distance_less_the_radius(pose):
    x, z, first, second = pose
    a, b = box(0.0, 0.0, first), capsule(x, z, second)
    (start, end), p = line(b), outline(a)
    fine = start + np.linspace(0, 1, 4001)[:, None] * (end - start)
    sides = [(p[k - 1], p[k]) for k in range(4)]
    own = (fine - p.mean(axis=0)) @ np.array([p[0] - p[1], p[0] - p[3]]).T / 2
    if (np.abs(own) < (0.5**2 + 1e-6, 0.3**2 + 1e-6)).all(axis=1).any():
        return  # the line itself is in the box
    away = min(*(to_segment(c, u, v) for c in (start, end) for u, v in sides), *(to_segment(c, start, end) for c in p))
    found = features(a, b)
    assert min(f[1] for f in found) == pytest.approx(away - 0.2, abs=ROUND)
    flipped = features(b, a)
    assert [f[1] for f in flipped] == pytest.approx([f[1] for f in found], abs=ROUND)
    for f, g in zip(found, flipped, strict=True):
        assert g[2] == pytest.approx(-f[2])


def test_a_capsule_across_an_edge_lies_on_its_inner_end_and_on_the_edge():
    found = [f for f in features(box(0.0, 0.0, 0.0), capsule(0.4, 0.5, math.pi / 2)) if abs(f[1]) < 1e-9]
    points = sorted(f[3][0] for f in found)
    assert points == pytest.approx([-0.1, 0.5])
    for f in found:
        assert f[2] == pytest.approx([0.0, 0.0, 1.0])


@given(st.tuples(*[st.floats(-1.5, 1.5)] * 3), st.tuples(*[st.floats(-1, 1)] * 4))
@settings(max_examples=100, deadline=None)
def test_a_capsules_gap_in_space_is_its_lines_distance_less_the_radius(place, turn):
    size = math.hypot(*turn)
    if size < 0.1:
        return
    a = Body("box", Box((0.5, 0.4, 0.3)), 1.0, (0.0, 0.0, 0.0))
    b = Body("capsule", Capsule(0.2, 0.5), 1.0, place, orientation=tuple(q / size for q in turn))
    solids, found = (
        build_solids(Scene("test", (a, b), 1.0, Model((0, 1, 2), rotation=True), 1.0, 1.0, 1.0), SPACE),
        room(),
    )
    count = find(solids, 0, 1, found)
    points = np.array(place) + np.linspace(-0.5, 0.5, 2001)[:, None] * rotation(b.orientation)[:, 2]
    away = np.linalg.norm(points - np.clip(points, *np.array([[-0.5, -0.4, -0.3], [0.5, 0.4, 0.3]])), axis=1).min()
    if away > 1e-3:  # else the line may cross the box
        # The nearest sample lies within 0.25 mm of the nearest point.
        assert away - 0.2 - 2.5e-4 <= found.gap[:count].min() <= away - 0.2 + ROUND
