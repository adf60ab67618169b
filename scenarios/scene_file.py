"""Scene files: a scene written as data, in TOML, MJCF or URDF, that stands wherever a scenario's name goes.

A file is only read: nothing in it is executed and no other file is opened. docs/scene-files.md lists the keys.
Such a scene has no truth. It is judged by invariants and by the same engine at half the step.
"""

from __future__ import annotations

import re
import stat
import tomllib
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from impactbench.scenarios import scene_defaults
from impactbench.scenarios.materials import MIXINGS, mixed
from impactbench.scenarios.records import (
    UPRIGHT,
    ZERO,
    Body,
    Box,
    Capsule,
    Contact,
    HalfSpace,
    Law,
    Quaternion,
    Scene,
    Shape,
    Sphere,
    Vector,
)
from impactbench.scenarios.scene_defaults import MOST_BODIES, Content
from impactbench.scenarios.scene_lines import key_lines
from impactbench.scenarios.scene_values import SceneError, Table, direction, nearest, printable, proper_name, shown
from impactbench.scenarios.truth import Case, Truth

LARGEST_FILE = 2**20
LONGEST_RUN = 3600.0
SELF_ERROR = "self_error"
MEASURES = (
    SELF_ERROR,
    "energy_gain",
    "energy_drift",
    "momentum_drift",
    "angular_momentum_drift",
    "penetration_max",
    "penetration_rms",
    "penetration_final",
    "impact_velocity_error",
)
"""What `measure` may name: the figures that need no truth."""

SHAPE_KEYS = {
    "sphere": ("radius",),
    "box": ("half_extents",),
    "capsule": ("radius", "half_length"),
    "plane": ("normal",),
}
PLACE_KEYS = ("name", "shape", "position", "bounciness")
BODY_KEYS = (*PLACE_KEYS, "orientation", "mass", "velocity", "spin", "inertia")
CONTACT_KEYS = ("bounciness", "friction", "viscosity")
SCENE_KEYS = (
    *("name", "duration", "gravity", "measure", "laws", "axes", "rotation", "touching", "mixing"),
    *("scales", "contact", "bodies", "statics", "pairs"),
)
PairContacts = tuple[tuple[str, str, Contact], ...]
MOST_MIXED = 300
_DEEP_KEY = re.compile(r"(?:[^\s.=#,\[\]]{1,64}[ \t]{0,4}\.[ \t]{0,4}){32}")
"""A key of very many parts takes the parser quadratic time."""


def is_scene_file(name: str) -> bool:
    return name.lower().endswith((".toml", ".xml", ".urdf"))


def read_case(name: str) -> Case:
    """The case a scene file describes. Raises SceneError: one line with the file, the line and the key."""
    path = Path(name)
    text = _text(path)
    if path.suffix.lower() == ".toml":
        case = _toml_case(text, path)
    else:
        from impactbench.scenarios.scene_import import imported_scene

        case = case_of(imported_scene(text, _shown_file(path), _title(path)))
    return case


def case_of(scene: Scene, headline: str = SELF_ERROR) -> Case:
    """The scene as a case without a truth: conservation and self-consistency only."""
    unknown = Truth("invariant", lambda _: None)
    return Case(scene, dict.fromkeys(scene.laws, unknown), headline, from_file=True)


def _shown_file(path: Path) -> str:
    return printable(path.name)


def _title(path: Path) -> str:
    """The scene's name where the file gives none."""
    try:
        return proper_name(path.stem)
    except ValueError as why:
        raise SceneError(f"{_shown_file(path)}: the file's name is no scene name: {why}") from None


def _text(path: Path) -> str:
    """The file's text; only a regular file of bounded size is opened."""
    file = _shown_file(path)
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise SceneError(f"{file}: is a folder, not a scene file")
        if not stat.S_ISREG(status.st_mode):
            raise SceneError(f"{file}: is not a regular file")
        with path.open("rb") as stream:
            data = stream.read(LARGEST_FILE + 1) if status.st_size <= LARGEST_FILE else b""
    except (OSError, ValueError) as why:
        if isinstance(why, SceneError):
            raise
        reason = getattr(why, "strerror", None) or str(why)
        raise SceneError(f"{file}: cannot be read: {reason}") from None
    size = max(status.st_size, len(data))
    if size > LARGEST_FILE:
        raise SceneError(f"{file}: {size} bytes; a scene file has at most {LARGEST_FILE}")
    if not data.strip():
        raise SceneError(f"{file}:1: the file is empty")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as why:
        line = data.count(b"\n", 0, why.start) + 1
        raise SceneError(f"{file}:{line}: is not UTF-8 text (byte {why.start})") from None


def _toml_case(text: str, path: Path) -> Case:
    top = _parsed(text, _shown_file(path))
    top.only(SCENE_KEYS, "a scene")
    name = top.name("name", "") or _title(path)
    headline = top.choice("measure", MEASURES, SELF_ERROR)
    return case_of(_scene(top, name), headline)


def _parsed(text: str, file: str) -> Table:
    if deep := _DEEP_KEY.search(text):
        raise SceneError(f"{file}:{text.count(chr(10), 0, deep.start()) + 1}: a key of more than 32 parts")
    try:
        values = tomllib.loads(text)
        lines = key_lines(text.replace("\r\n", "\n"))
    except RecursionError:
        raise SceneError(f"{file}:1: brackets are nested too deep") from None
    except ValueError as why:
        raise SceneError(_syntax(file, text, str(why))) from None
    return Table(file, values, lines)


def _syntax(file: str, text: str, why: str) -> str:
    """tomllib ends its message with (at line 3, column 7) or (at end of document)."""
    found = re.search(r" \(at (?:line (\d+), column \d+|end of document)\)$", why)
    line = (found and found[1]) or str(text.count("\n") + 1 if found else 1)
    return f"{file}:{line}: not valid TOML: {printable(why[: found.start()] if found else why)[:200]}"


def _scene(top: Table, name: str) -> Scene:
    contact = _contact(top.table("contact"), Contact())
    bodies = _bodies(top)
    pairs = _mixed(top, contact, bodies, _pairs(top, contact, bodies))
    gravity = top.vector("gravity", ZERO)
    content = Content(bodies, gravity, _duration(top), (contact, *(own for _, _, own in pairs)))
    try:
        scene = scene_defaults.complete(name, content, contact, pairs)
    except ValueError as why:
        top.fail(str(why), "contact")
    return _with_choices(scene, top, content)


def _duration(top: Table) -> float:
    duration = top.positive("duration")
    if duration > LONGEST_RUN:
        top.fail(f"at most {LONGEST_RUN:g} s, got {duration:g}", "duration")
    return duration


def _with_choices(scene: Scene, top: Table, content: Content) -> Scene:
    """The scene with what the file chooses itself in place of what was worked out."""
    axes = _axes(top, content) if "axes" in top.values else None
    rotation = top.flag("rotation", False) if "rotation" in top.values else None
    sizes = top.table("scales")
    sizes.only(("length", "speed", "energy"), "scales")
    given = {key: sizes.positive(key) for key in sizes.values}
    if "energy" not in given and "speed" in given:
        given["energy"] = scene.energy * (given["speed"] / scene.speed) ** 2
    return replace(
        scene,
        model=scene_defaults.model(content, axes, rotation),
        laws=_laws(top, scene.laws),
        phase_free=not top.flag("touching", not scene.phase_free),
        **given,  # type: ignore[arg-type]
    )


def _axes(top: Table, content: Content) -> tuple[int, ...]:
    text = top.choice("axes", ("x", "y", "z", "xy", "xz", "yz", "xyz"))
    for body in content.movable:
        for k, axis in enumerate("xyz"):
            if axis not in text and body.velocity[k]:
                top.fail(f"{body.name} moves along {axis}, which {shown(text)} leaves out", "axes")
    return tuple("xyz".index(axis) for axis in text)


def _laws(top: Table, possible: tuple[Law, ...]) -> tuple[Law, ...]:
    if "laws" not in top.values:
        return possible
    wanted = top.get("laws")
    if not isinstance(wanted, list) or not wanted or not all(law in possible for law in wanted):
        top.fail(f"expected one or more of {', '.join(possible)} in brackets, got {shown(wanted)}", "laws")
    return tuple(law for law in possible if law in wanted)


def _bodies(top: Table) -> tuple[Body, ...]:
    tables = [*top.tables("bodies"), *top.tables("statics")]
    if not top.tables("bodies"):
        top.fail("a scene needs at least one [[bodies]] table: a body that can move", "bodies")
    if len(tables) > MOST_BODIES:
        top.fail(f"{len(tables)} bodies and statics; at most {MOST_BODIES}", "bodies")
    bodies = tuple(_body(table) for table in tables)
    counts = Counter(body.name for body in bodies)
    for table, body in zip(reversed(tables), reversed(bodies), strict=True):
        if counts[body.name] > 1:
            table.fail(f"two bodies are named {shown(body.name)}", "name")
    return bodies


def _body(table: Table) -> Body:
    static = table.path[0] == "statics"
    kind = table.choice("shape", tuple(SHAPE_KEYS))
    if kind == "plane" and not static:
        table.fail("a plane never moves: list it under [[statics]]", "shape")
    place = (*PLACE_KEYS, "orientation") if kind != "plane" else PLACE_KEYS
    table.only((*(place if static else BODY_KEYS), *SHAPE_KEYS[kind]), f"a {'static' if static else 'movable'} {kind}")
    name = table.name("name", f"{table.path[0]}[{table.path[1]}]")
    shape, position = _shape(table, kind), table.vector("position")
    orientation = _orientation(table)
    if static:
        return Body(name, shape, None, position, orientation=orientation)
    mass, inertia = table.positive("mass"), _inertia(table)
    velocity, spin = table.vector("velocity", ZERO), table.vector("spin", ZERO)
    return Body(name, shape, mass, position, velocity, orientation, spin, inertia)


def _shape(table: Table, kind: str) -> Shape:
    readers: dict[str, Callable[[], Shape]] = {
        "sphere": lambda: Sphere(table.positive("radius")),
        "box": lambda: Box(_positives(table, "half_extents")),
        "capsule": lambda: Capsule(table.positive("radius"), table.positive("half_length")),
        "plane": lambda: HalfSpace(_unit(table, "normal", 3)),
    }
    return readers[kind]()


def _positives(table: Table, key: str) -> Vector:
    vector = table.vector(key)
    for i, value in enumerate(vector):
        if value < 1e-30:
            table.fail(f"must be positive, got {value:g}", key, i)
    return vector


def _unit(table: Table, key: str, count: int) -> Any:
    try:
        return direction(table.numbers(key, count))
    except SceneError:
        raise
    except ValueError as why:
        table.fail(str(why), key)


def _orientation(table: Table) -> Quaternion:
    if "orientation" not in table.values:
        return UPRIGHT
    w, x, y, z = _unit(table, "orientation", 4)
    return (w, x, y, z)


def _inertia(table: Table) -> Vector | None:
    if "inertia" not in table.values:
        return None
    moments = _positives(table, "inertia")
    if 2 * max(moments) > sum(moments) * (1 + 1e-9):
        table.fail("no solid has these: one moment exceeds the sum of the other two", "inertia")
    return moments


def _contact(table: Table, base: Contact, more: tuple[str, ...] = ()) -> Contact:
    table.only((*more, *CONTACT_KEYS), "a pair" if more else "contact")
    return Contact(
        table.between("bounciness", base.bounciness, 0, 1),
        table.between("friction", base.friction, 0, np.inf),
        table.between("viscosity", base.viscosity, 0, np.inf),
    )


def _pairs(top: Table, base: Contact, bodies: tuple[Body, ...]) -> PairContacts:
    found: dict[frozenset[str], tuple[str, str, Contact]] = {}
    static = {body.name: body.static for body in bodies}
    for table in top.tables("pairs"):
        own = _contact(table, base, ("between",))
        a, b = _two_names(table, static)
        if frozenset((a, b)) in found:
            table.fail(f"the pair {shown(a)}, {shown(b)} is listed twice", "between")
        found[frozenset((a, b))] = (a, b, own)
    return tuple(found.values())


def _mixed(top: Table, base: Contact, bodies: tuple[Body, ...], listed: PairContacts) -> PairContacts:
    """Pairs of bodies with a bounciness of their own, by the file's mixing (documents, rule R10)."""
    mixing = top.choice("mixing", tuple(MIXINGS), "average")
    tables = [*top.tables("bodies"), *top.tables("statics")]
    own = {
        body.name: table.between("bounciness", base.bounciness, 0, 1)
        for table, body in zip(tables, bodies, strict=True)
        if "bounciness" in table.values
    }
    if own and len(bodies) > MOST_MIXED:
        top.fail(
            f"{len(bodies)} bodies; those with a bounciness of their own are paired in scenes of up to {MOST_MIXED}"
        )
    return mixed(bodies, own, mixing, base, listed)


def _two_names(table: Table, static: dict[str, bool]) -> tuple[str, str]:
    names = table.get("between")
    if not isinstance(names, list) or len(names) != 2 or not all(isinstance(name, str) for name in names):
        table.fail(f"expected the names of two bodies, got {shown(names)}", "between")
    for i, name in enumerate(names):
        if name not in static:
            known = list(static)[:1000]
            table.fail(f"no body is named {shown(name)}; {nearest(name, known)[:300]}", "between", i)
    a, b = names
    if a == b or (static[a] and static[b]):
        table.fail("a body with itself" if a == b else "two statics never meet", "between")
    return a, b
