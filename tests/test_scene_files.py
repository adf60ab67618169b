"""Scene files as a user meets them: good ones run, every broken one is one clear line with the place."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from impactbench.reports.measures import self_consistency
from impactbench.scenarios import scene_file
from impactbench.scenarios.catalogue import select
from impactbench.scenarios.records import Box, Capsule, Contact, HalfSpace, Scene, Sphere
from impactbench.scenarios.scene_file import LARGEST_FILE, MEASURES, read_case
from impactbench.scenarios.scene_lines import key_lines
from impactbench.scenarios.scene_values import LARGEST, SceneError
from impactbench.scenarios.trajectory import Trajectory

COMMAND = str(Path(sys.executable).parent / "impactbench")
DOCUMENT = Path(__file__).parents[1] / "docs" / "scene-files.md"

BALL = """\
[[bodies]]
name = "ball"
shape = "sphere"
radius = 0.1
mass = 1.0
position = [0, 0, 0.5]
"""
FLOOR = """\
[[statics]]
name = "floor"
shape = "plane"
position = [0, 0, 0]
normal = [0, 0, 1]
"""
HEAD = """\
name = "drop"
duration = 0.5
gravity = [0, 0, -9.81]
"""
DROP = f"{HEAD}[contact]\nbounciness = 0.5\n{BALL}{FLOOR}"


def impactbench(*words: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([COMMAND, *words], capture_output=True, text=True, check=False, timeout=300, cwd=cwd)


def read(folder: Path, text: str, name: str = "scene.toml") -> Scene:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return read_case(str(path)).scene


# --- good files ---


def test_a_scene_file_runs(tmp_path: Path) -> None:
    (tmp_path / "drop.toml").write_text(DROP)
    done = impactbench("run", "drop.toml", "--engine", "pymunk/tuned", "--step", "1/60", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("drop  pymunk/tuned")
    for measure in ("self_error", "self_horizon", "energy_gain", "penetration_max"):
        assert measure in done.stdout


HOSTILE = "<script>alert(1)</script> & [/b]"


def test_compare_takes_scene_files_beside_scenarios_and_shows_names_as_text(tmp_path: Path) -> None:
    (tmp_path / "evil.toml").write_text(DROP.replace('"drop"', f'"{HOSTILE}"').replace('"ball"', '"<b>ball</b>"'))
    words = ("evil.toml", "static_wall[bounciness=0.5]", "--engine", "pymunk/tuned", "--timing", "none")
    done = impactbench("compare", *words, "--step", "1/60", "--step", "1/120", "--out", "out", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert "[/b]" in done.stdout  # the table may break the name into lines
    document = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))
    assert {cell["case"]: cell["state"] for cell in document["cells"]} == {
        HOSTILE: "ok",
        "static_wall[bounciness=0.5]": "ok",
    }
    described = next(case for case in document["cases"] if case["name"] == HOSTILE)
    assert (described["headline"], set(described["truth"].values())) == ("self_error", {"invariant"})
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<script>alert(1)" not in page
    assert str(tmp_path) not in page


def test_what_is_not_given_is_the_smallest_that_shows_the_motion(tmp_path: Path) -> None:
    scene = read(tmp_path, DROP)
    assert (scene.model.axes, scene.model.rotation, scene.model.gravity) == ((2,), False, True)
    assert scene.laws == ("doc", "nc")
    assert scene.phase_free
    assert scene.length == pytest.approx(0.6)  # from the floor to the ball's top
    assert scene.speed == pytest.approx(np.sqrt(2 * 9.81 * 0.5))
    assert scene.energy == pytest.approx(9.81 * 0.5)


@pytest.mark.parametrize(
    ("old", "new", "axes", "rotation"),
    [
        ("mass = 1.0", "mass = 1.0\nvelocity = [1, 0, 0]", (0, 2), False),
        ("mass = 1.0", "mass = 1.0\nvelocity = [1, 0, 0]\nspin = [0, 3, 0]", (0, 2), True),
        ("mass = 1.0", "mass = 1.0\nvelocity = [1, 0, 0]\nspin = [3, 0, 0]", (0, 1, 2), True),
        ("bounciness = 0.5", "friction = 0.5", (2,), False),
        ("normal = [0, 0, 1]", "normal = [1, 0, 3]", (0, 2), False),
        ('"sphere"\nradius = 0.1', '"box"\nhalf_extents = [1, 1, 1]\norientation = [1, 0, 0.5, 0]', (0, 1, 2), True),
        ("gravity", 'axes = "xz"\nrotation = true\ngravity', (0, 2), True),
    ],
)
def test_the_model_grows_with_what_can_move(
    tmp_path: Path, old: str, new: str, axes: tuple[int, ...], rotation: bool
) -> None:
    model = read(tmp_path, DROP.replace(old, new)).model
    assert (model.axes, model.rotation) == (axes, rotation)


def test_friction_decides_the_laws_and_touching_bodies_are_noticed(tmp_path: Path) -> None:
    assert read(tmp_path, DROP.replace("bounciness", "friction")).laws == ("nc",)
    assert read(tmp_path, DROP.replace("bounciness", "viscosity")).laws == ("doc",)
    assert not read(tmp_path, DROP.replace("0, 0.5]", "0, 0.1]")).phase_free
    # It left the floor less than a step ago.
    assert not read(tmp_path, DROP.replace("mass = 1.0", "mass = 1.0\nvelocity = [0, 0, 40]")).phase_free


def test_directions_are_scaled_to_length_one(tmp_path: Path) -> None:
    scene = read(tmp_path, DROP.replace("[0, 0, 1]", "[0, 3, 4]").replace("mass", "orientation = [2, 0, 0, 0]\nmass"))
    assert scene.bodies[1].shape == HalfSpace((0.0, 0.6, 0.8))
    assert scene.bodies[0].orientation == (1.0, 0.0, 0.0, 0.0)


def test_pairs_have_their_own_coefficients_and_the_scene_its_own_scales(tmp_path: Path) -> None:
    text = DROP + '[[pairs]]\nbetween = ["floor", "ball"]\nbounciness = 1\n[scales]\nspeed = 2\nlength = 3\n'
    scene = read(tmp_path, text)
    assert scene.contact_of(0, 1) == Contact(bounciness=1.0)
    assert (scene.length, scene.speed) == (3.0, 2.0)
    assert scene.energy == pytest.approx(2.0)  # m v^2/2 at the given speed


def test_every_measure_a_file_may_name_is_one_that_runs_report(tmp_path: Path) -> None:
    two = BALL.replace('"ball"', '"other"').replace("0, 0.5", "0.01, 1.5")
    found: set[str] = set()
    scenes = {
        "a": DROP.replace("0.5\n[[b", "1\n[[b"),
        "b": f"name = 'p'\nduration = 2\n{BALL}velocity = [0,0,1]\n{two}",
    }
    for name, text in scenes.items():
        (tmp_path / f"{name}.toml").write_text(text)
        found |= set(
            impactbench(
                "run", f"{name}.toml", "--engine", "mujoco/tuned", "--step", "1/60", cwd=tmp_path
            ).stdout.split()
        )
    assert set(MEASURES) <= found


def test_the_document_s_example_runs_as_it_stands(tmp_path: Path) -> None:
    example = DOCUMENT.read_text(encoding="utf-8").split("```toml\n")[1].split("```")[0]
    (tmp_path / "example.toml").write_text(example)
    done = impactbench("run", "example.toml", "--engine", "mujoco/tuned", "--step", "1/240", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


def test_the_document_names_every_key() -> None:
    text = DOCUMENT.read_text(encoding="utf-8")
    keys = {*scene_file.SCENE_KEYS, *scene_file.BODY_KEYS, *scene_file.CONTACT_KEYS, "between", *MEASURES}
    keys |= {key for own in scene_file.SHAPE_KEYS.values() for key in own}
    assert not [
        key for key in keys if f"`{key}`" not in text and f"`[{key}]`" not in text and f"`[[{key}]]`" not in text
    ]


def test_a_scene_too_large_to_measure_says_so_before_it_runs(tmp_path: Path) -> None:
    balls = "".join(BALL.replace('name = "ball"\n', "").replace("0, 0, 0.5", f"{i}, 0, 1") for i in range(1000))
    (tmp_path / "many.toml").write_text(HEAD + balls)
    done = impactbench("run", "many.toml", "--engine", "mujoco/tuned", "--step", "1/480", cwd=tmp_path)
    assert done.returncode == 3
    assert "unsupported (499500 pairs at 240 steps" in done.stdout


def test_self_consistency_is_the_largest_distance_and_the_time_it_stays_small() -> None:
    times, still = np.arange(5.0), np.zeros((5, 1, 3))
    moved = still.copy()
    moved[:, 0, 0] = [0, 0.01, 0.03, 0.5, 0.2]  # [m], in a scene of length 2 m
    scene = replace(select(["static_wall"])[0].scene, length=2.0)
    figures = self_consistency(scene, Trajectory(times, still, still), Trajectory(times, moved, still))
    assert {f.measure: f.value for f in figures} == {"self_error": 0.25, "self_horizon": 0.5}
    lost = self_consistency(scene, Trajectory(times, still, still), Trajectory(times, moved * np.nan, still))
    assert [f.value for f in lost] == [np.inf]


# --- broken files ---


def changed(old: str, new: str) -> bytes:
    assert old in DROP
    return DROP.replace(old, new, 1).encode()


PAIR = '[[pairs]]\nbetween = ["ball", "flor"]\n'
BROKEN: dict[str, tuple[bytes, str, tuple[str, ...]]] = {
    # name: content, place, words of the message
    "wrong type": (changed("mass = 1.0", 'mass = "heavy"'), ":10: bodies[0].mass: ", ("number", "'heavy'")),
    "boolean": (changed("mass = 1.0", "mass = true"), ":10: bodies[0].mass: ", ("number", "True")),
    "unknown key": (changed("mass = 1.0", "mas = 1.0"), ":10: bodies[0].mas: ", ("no such key", "nearest: mass")),
    "unknown key on top": (changed("gravity", "gravty"), ":3: gravty: ", ("nearest: gravity",)),
    "unknown table": (DROP.encode() + b"[solver]\nx = 1\n", ":17: solver: ", ("no such key",)),
    "key of another shape": (changed("radius = 0.1", "radius = 0.1\nnormal = [0,0,1]"), ":10: bodies[0].normal: ", ()),
    "nan": (changed("0, 0.5]", "0, nan]"), ":11: bodies[0].position[2]: ", ("finite", "nan")),
    "inf": (changed("duration = 0.5", "duration = inf"), ":2: duration: ", ("finite", "inf")),
    "huge": (changed("mass = 1.0", "mass = 1e300"), ":10: bodies[0].mass: ", ("1e+30",)),
    "huge integer": (changed("mass = 1.0", f"mass = {10**400}"), ":10: bodies[0].mass: ", ("finite",)),
    "endless integer": (changed("mass = 1.0", f"mass = {'9' * 9000}"), ":1: ", ("not valid TOML",)),
    "negative mass": (changed("mass = 1.0", "mass = -1.0"), ":10: bodies[0].mass: ", ("positive", "-1")),
    "zero radius": (changed("radius = 0.1", "radius = 0"), ":9: bodies[0].radius: ", ("positive",)),
    "unknown shape": (changed('"sphere"', '"spere"'), ":8: bodies[0].shape: ", ("'spere'", "nearest: sphere")),
    "moving plane": (changed('"sphere"', '"plane"'), ":8: bodies[0].shape: ", ("[[statics]]",)),
    "moving static": (changed("normal", "velocity = [1,0,0]\nnormal"), ":16: statics[0].velocity: ", ("static",)),
    "bouncier than 1": (changed("= 0.5\n[[", "= 1.5\n[["), ":5: contact.bounciness: ", ("between 0 and 1",)),
    "negative friction": (changed("bounciness = 0.5", "friction = -1"), ":5: contact.friction: ", ("at least 0",)),
    "both frictions": (changed("bounciness = 0.5", "friction=1\nviscosity=1"), ":4: contact: ", ("no law",)),
    "law without meaning": (changed("duration", 'laws=["docs"]\nduration'), ":2: laws: ", ("doc, nc",)),
    "short vector": (changed("[0, 0, 0.5]", "[0, 0.5]"), ":11: bodies[0].position: ", ("3 numbers",)),
    "zero quaternion": (
        changed("mass", "orientation = [0,0,0,0]\nmass"),
        ":10: bodies[0].orientation: ",
        ("length 0",),
    ),
    "zero normal": (changed("[0, 0, 1]", "[0, 0, 0]"), ":16: statics[0].normal: ", ("length 0",)),
    "impossible inertia": (changed("mass", "inertia=[1,1,3]\nmass"), ":10: bodies[0].inertia: ", ("moment",)),
    "missing mass": (changed("mass = 1.0\n", ""), ":6: bodies[0]: ", ("mass is missing",)),
    "missing duration": (changed("duration = 0.5\n", ""), ":1: ", ("duration is missing",)),
    "too long": (changed("duration = 0.5", "duration = 1e9"), ":2: duration: ", ("3600",)),
    "nothing movable": ((HEAD + FLOOR).encode(), ":1: bodies: ", ("at least one",)),
    "no table": (b"duration = 1\nbodies = [1]\n", ":2: bodies[0]: ", ("table",)),
    "bodies no list": (b"duration = 1\nbodies = 1\n", ":2: bodies: ", ("[[bodies]]",)),
    "duplicate key": (changed("mass = 1.0", "mass = 1.0\nmass = 2.0"), ":11: ", ("not valid TOML",)),
    "duplicate name": (changed('"floor"', '"ball"'), ":13: statics[0].name: ", ("'ball'",)),
    "unknown body in a pair": (
        DROP.encode() + PAIR.encode(),
        ":18: pairs[0].between[1]: ",
        ("'flor'", "nearest: floor"),
    ),
    "pair with itself": (DROP.encode() + PAIR.replace("flor", "ball").encode(), ":18: pairs[0].between: ", ("itself",)),
    "pair twice": (DROP.encode() + PAIR.replace("flor", "floor").encode() * 2, ":20: pairs[1].between: ", ("twice",)),
    "unknown measure": (changed("duration", 'measure="enrgy_gain"\nduration'), ":2: measure: ", ("energy_gain",)),
    "axes too few": (
        changed("mass", "velocity = [1,0,0]\nmass").replace(b"dur", b'axes="z"\ndur'),
        ":2: axes: ",
        ("x",),
    ),
    "scene named as a family": (changed('"drop"', '"free_flight[x]"'), ": name 'free_flight[x]'", ("catalogue",)),
    "name too long": (changed('"drop"', f'"{"x" * 201}"'), ":1: name: ", ("200",)),
    "escape in a name": (changed('"drop"', '"a\\u001b[31mb"'), ":1: name: ", ("printable", "\\x1b")),
    "line break in a name": (changed('"ball"', '"a\\nb"'), ":7: bodies[0].name: ", ("printable",)),
    "direction mark in a name": (changed('"drop"', '"a\\u202eb"'), ":1: name: ", ("printable",)),
    "escape in a key": (b'"a\\u001b[31m" = 1\n', ":1: ", ("no such key",)),
    "syntax": (changed("mass = 1.0", "mass = = 1.0"), ":10: ", ("not valid TOML",)),
    "unfinished": (DROP.encode() + b"x = [1,\n", ":18: ", ("not valid TOML",)),
    "empty": (b"", ":1: ", ("empty",)),
    "binary": (b"\x7fELF\x02\x01\n\xff\xfe\x00", ":2: ", ("UTF-8",)),
    "nul": (b"name = \x00", ":1: ", ("not valid TOML",)),
    "deep": (b"x = " + b"[" * 100_000, ":1: ", ("deep",)),
    "long key": (b"a" + b".a" * 100_000 + b" = 1", ":1: ", ("32 parts",)),
    "many bodies": (b"duration=1\nbodies=[" + b"{}," * 10_001 + b"]", ":2: bodies: ", ("10001", "10000")),
    "too large": (b"#" * (LARGEST_FILE + 1), ": ", ("at most",)),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_a_broken_file_is_one_line_with_the_place(kind: str, tmp_path: Path) -> None:
    content, place, words = BROKEN[kind]
    check_refused(tmp_path, "scene.toml", content, place, words)


def check_refused(folder: Path, name: str, content: bytes, place: str, words: tuple[str, ...]) -> None:
    """Through the same call that the command line makes: some processes below show that it prints what we see here."""
    (folder / name).write_bytes(content)
    with pytest.raises(SceneError) as refusal:
        select([str(folder / name)])
    message = str(refusal.value)
    assert message.startswith(f"{name}{place}")
    assert message.isprintable()
    assert len(message) < 600
    for word in words:
        assert word in message


@pytest.mark.parametrize("kind", ["wrong type", "escape in a name", "escape in a key", "binary", "deep", "empty"])
@pytest.mark.parametrize("command", ["run", "compare"])
def test_the_command_line_prints_that_line_and_exits_with_2(kind: str, command: str, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_bytes(BROKEN[kind][0])
    more = ["--step", "1/60", "--engine", "pymunk/tuned"]
    check_one_line(impactbench(command, "scene.toml", *more, cwd=tmp_path), BROKEN[kind][1])


def check_one_line(done: subprocess.CompletedProcess[str], hint: str) -> None:
    assert (done.returncode, done.stdout) == (2, "")
    assert len(done.stderr.splitlines()) == 1
    assert done.stderr.rstrip("\n").isprintable()
    assert hint.strip() in done.stderr


def sparse(path: Path) -> None:
    with path.open("wb") as stream:
        stream.truncate(100 * 2**20)


PLACES: dict[str, tuple[Callable[[Path], object], str]] = {
    "missing": (lambda path: None, "No such file"),
    "folder": (lambda path: path.mkdir(), "folder"),
    "pipe": (lambda path: os.mkfifo(path), "regular file"),
    "100 MB": (sparse, "at most"),
    "loop": (lambda path: path.symlink_to(path.name), "cannot be read"),
    "name too long for the system": (lambda path: None, "cannot be read"),
}


@pytest.mark.parametrize("suffix", ["toml", "xml", "urdf"])
@pytest.mark.parametrize("kind", PLACES)
def test_what_is_no_file_to_read_is_one_line(kind: str, suffix: str, tmp_path: Path) -> None:
    make, hint = PLACES[kind]
    path = tmp_path / (f"{'x' * 300 if 'long' in kind else 'scene'}.{suffix}")
    make(path)
    with pytest.raises(SceneError, match=hint):
        select([str(path)])


def test_a_hostile_file_name_is_replaced_in_messages(tmp_path: Path) -> None:
    name = "a\x1b[31m\n<b>.toml"
    (tmp_path / name).write_text(DROP.replace('name = "drop"\n', ""))
    check_one_line(impactbench("run", name, "--step", "1/60", "--engine", "pymunk/tuned", cwd=tmp_path), "printable")
    check_one_line(impactbench("run", "b\x1b.toml", "--step", "1/60", "--engine", "pymunk", cwd=tmp_path), "b?.toml")


def test_two_files_of_one_name_are_refused(tmp_path: Path) -> None:
    for name in ("a.toml", "b.toml"):
        (tmp_path / name).write_text(DROP)
    with pytest.raises(SceneError, match=r"b\.toml: another"):
        select([str(tmp_path / "a.toml"), str(tmp_path / "b.toml")])


# --- lines of keys ---


def test_lines_are_found_in_every_way_to_write_a_key() -> None:
    text = '''# comment = 1
a.b = [1, # one ] [
  "]", """
x = 3
""", {c = 1, 'd e' = [2]}]
"q.r" = '#'
[t . u]
v = 1
[[w]]
[[w]]
x = {y.z = 1}
[w.k]
l = 1e5
'''
    lines = key_lines(text)
    assert {path: lines[path] for path in lines if path} == {
        ("a",): 2,
        ("a", "b"): 2,
        ("a", "b", 0): 2,
        ("a", "b", 1): 3,
        ("a", "b", 2): 3,
        ("a", "b", 3): 5,
        ("a", "b", 3, "c"): 5,
        ("a", "b", 3, "d e"): 5,
        ("a", "b", 3, "d e", 0): 5,
        ("q.r",): 6,
        ("t", "u"): 7,
        ("t", "u", "v"): 8,
        ("w",): 9,
        ("w", 0): 9,
        ("w", 1): 10,
        ("w", 1, "x"): 11,
        ("w", 1, "x", "y"): 11,
        ("w", 1, "x", "y", "z"): 11,
        ("w", 1, "k"): 12,
        ("w", 1, "k", "l"): 13,
    }


# --- round trip ---

numbers = st.floats(-1e6, 1e6)
vectors = st.tuples(numbers, numbers, numbers)
positive = st.floats(1e-6, 1e6)
names = st.text(st.characters(exclude_categories=["C", "Z"]), min_size=1, max_size=20)


@settings(max_examples=60, deadline=None)
@given(names, positive, positive, vectors, vectors, vectors, st.floats(0, 1))
def test_what_is_written_is_what_is_read(
    tmp_path_factory: pytest.TempPathFactory,
    name: str,
    mass: float,
    radius: float,
    x: tuple[float, float, float],
    v: tuple[float, float, float],
    g: tuple[float, float, float],
    bounciness: float,
) -> None:
    quoted = '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'
    text = f"duration = 1\ngravity = {list(g)}\ncontact.bounciness = {bounciness!r}\n[[bodies]]\nname = {quoted}\n"
    text += f'shape = "sphere"\nmass = {mass!r}\nradius = {radius!r}\nposition = {list(x)}\nvelocity = {list(v)}\n'
    scene = read(tmp_path_factory.mktemp("scene"), text)
    body = scene.bodies[0]
    assert (body.name, body.mass, body.shape, body.position, body.velocity) == (name, mass, Sphere(radius), x, v)
    assert (scene.gravity, scene.contact.bounciness) == (g, bounciness)
    assert scene.length > 0
    assert scene.speed > 0
    assert scene.energy > 0


@settings(max_examples=300, deadline=None)
@given(st.data())
def test_a_damaged_file_is_read_or_refused_in_one_line(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """Bytes changed at random: no other exception, ever."""
    content = bytearray(DROP.encode())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.sampled_from(b'[]{}"=.,\n\\ 0e-x#\x00\xff'))
    path = tmp_path_factory.mktemp("scene") / "scene.toml"
    path.write_bytes(bytes(content))
    refusal = ""
    try:
        read_case(str(path))
    except SceneError as error:
        refusal = str(error)
    assert refusal.isprintable()


# --- MJCF and URDF ---

MJCF = """\
<mujoco model="three">
  <compiler angle="radian"/>
  <option gravity="0 0 -9.8" timestep="0.01"/>
  <default><geom condim="1"/></default>
  <worldbody>
    <light pos="0 0 3"/>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body name="ball" pos="0 0 1"><freejoint/><geom type="sphere" size="0.1" mass="2"/></body>
    <body name="box" pos="1 0 1" euler="0 0.5 0"><freejoint/><geom type="box" size="0.1 0.2 0.3" mass="3"/></body>
    <body name="rod" pos="2 0 1"><joint type="free"/><geom type="capsule" size="0.1 0.2" mass="1"/></body>
  </worldbody>
  <keyframe><key qvel="1 2 3 0 0 0  0 0 0 0 0 4  0 0 0 0 0 0"/></keyframe>
</mujoco>
"""
URDF = """\
<robot name="one">
  <link name="ground"><collision><geometry><box size="2 2 0.2"/></geometry></collision></link>
  <link name="ball">
    <inertial>
      <mass value="2"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <visual><geometry><sphere radius="0.5"/></geometry></visual>
    <collision><geometry><sphere radius="0.1"/></geometry></collision>
  </link>
  <joint name="loose" type="floating"><parent link="ground"/><child link="ball"/><origin xyz="0 0 1"/></joint>
</robot>
"""


def test_mjcf_means_what_it_means_to_mujoco(tmp_path: Path) -> None:
    scene = read(tmp_path, MJCF, "three.xml")
    ball, box, rod, floor = scene.bodies
    assert [body.name for body in scene.bodies] == ["ball", "box", "rod", "floor"]
    assert (ball.shape, ball.mass, ball.position, ball.velocity) == (Sphere(0.1), 2.0, (0.0, 0.0, 1.0), (1.0, 2.0, 3.0))
    assert (box.shape, rod.shape) == (Box((0.1, 0.2, 0.3)), Capsule(0.1, 0.2))
    assert box.orientation == pytest.approx((np.cos(0.25), 0, np.sin(0.25), 0))
    # MuJoCo states the spin in the body's own axes: its z leans by half a radian towards x.
    assert box.spin == pytest.approx((4 * np.sin(0.5), 0, 4 * np.cos(0.5)))
    assert {body.inertia for body in scene.bodies} == {None}
    assert floor.shape == HalfSpace((0.0, 0.0, 1.0))
    assert floor.static
    assert (scene.gravity, scene.contact, scene.pairs) == ((0.0, 0.0, -9.8), Contact(0.0), ())
    assert scene.name == "three"


def test_mjcf_friction_is_combined_as_mujoco_does(tmp_path: Path) -> None:
    """The larger of the two, unless a pair is listed or one has priority."""
    text = MJCF.replace('<default><geom condim="1"/></default>', "")
    text = text.replace('size="0.1"', 'size="0.1" friction="0.2"').replace("1 1 1", '1 1 1" friction="0.3')
    text = text.replace('"0.1 0.2"', '"0.1 0.2" name="r" priority="1" friction="0.1"')
    text = text.replace('0.2 0.3"', '0.2 0.3" name="b"').replace(
        "<keyframe>", '<contact><pair geom1="b" geom2="floor" friction="0.7 0.7"/></contact><keyframe>'
    )
    scene = read(tmp_path, text, "three.xml")
    frictions = {(a, b): scene.contact_of(a, b).friction for a in range(3) for b in range(a + 1, 4)}
    assert frictions == {(0, 1): 1.0, (0, 2): 0.1, (0, 3): 0.3, (1, 2): 0.1, (1, 3): 0.7, (2, 3): 0.1}
    assert scene.laws == ("nc",)


def test_urdf_moves_what_floats(tmp_path: Path) -> None:
    scene = read(tmp_path, URDF, "one.urdf")
    ball, ground = scene.bodies
    assert (ball.name, ball.shape, ball.mass, ball.position) == ("ball", Sphere(0.1), 2.0, (0.0, 0.0, 1.0))
    assert ball.inertia == pytest.approx((0.01, 0.01, 0.01))  # not that of a uniform ball: 0.008
    assert (ground.shape, ground.static) == (Box((1.0, 1.0, 0.1)), True)
    assert scene.contact == Contact(0.0)


@pytest.mark.parametrize(("name", "text"), [("a.urdf", URDF), ("a.xml", MJCF.replace("capsule", "sphere"))])
def test_imports_run(name: str, text: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    done = impactbench("run", name, "--engine", "mujoco/tuned", "--step", "1/120", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert "self_error" in done.stdout
    assert [path.name for path in tmp_path.iterdir()] == [name]


def mjcf(old: str, new: str) -> tuple[str, bytes]:
    assert old in MJCF
    return "s.xml", MJCF.replace(old, new, 1).encode()


def urdf(old: str, new: str) -> tuple[str, bytes]:
    assert old in URDF
    return "s.urdf", URDF.replace(old, new, 1).encode()


HINGED = b'<mujoco><worldbody><body><joint/><geom size="1"/></body></worldbody></mujoco>'
ONE_STATIC = b'<mujoco><worldbody><geom size="1"/></worldbody></mujoco>'
REFUSED: dict[str, tuple[tuple[str, bytes], str, tuple[str, ...]]] = {
    "include": (mjcf("<worldbody>", '<include file="/etc/passwd"/><worldbody>'), ":5: ", ("<include>",)),
    "mesh asset": (mjcf("<worldbody>", '<asset><mesh file="a.obj"/></asset><worldbody>'), ":5: ", ("<asset>",)),
    "mesh geom": (mjcf('type="sphere"', 'type="mesh" mesh="a"'), ":8: ", ("<geom> of type mesh",)),
    "cylinder": (mjcf('"capsule" size="0.1 0.2"', '"cylinder" size="0.1 0.2"'), ":10: ", ("<geom>", "cylinder")),
    "hinge": (mjcf('type="free"', 'name="knee" type="hinge"'), ":10: ", ("<joint> 'knee'", "hinge")),
    "hinge by default": (
        mjcf("<default>", '<default><joint type="hinge"/>'),
        ":4: ",
        ("hinge",),
    ),
    "tendon": (mjcf("<keyframe>", "<tendon/><keyframe>"), ":12: ", ("<tendon>",)),
    "actuator": (mjcf("<keyframe>", "<actuator/><keyframe>"), ":12: ", ("<actuator>",)),
    "plugin": (mjcf("<worldbody>", "<extension/><worldbody>"), ":5: ", ("<extension>",)),
    "wind": (mjcf("<option", '<option wind="1 0 0"'), ":3: ", ("wind of <option>",)),
    "softness": (mjcf('mass="2"', 'mass="2" solref="0.1 1"'), ":8: ", ("solref of <geom>",)),
    "rolling friction": (mjcf('condim="1"', 'condim="6"'), ": 'ball'", ("condim 6",)),
    "masks": (mjcf('mass="2"', 'mass="2" contype="2"'), ": 'ball'", ("contype",)),
    "two geoms": (mjcf('mass="2"/>', 'mass="2"/><geom size="1"/>'), ": body 'ball'", ("2 geoms",)),
    "geom off centre": (
        mjcf('mass="2"/>', 'mass="2"/><inertial pos="0 0 1" mass="1" diaginertia="1 1 1"/>'),
        ": body 'ball'",
        ("centre of mass",),
    ),
    "nothing free": (("s.xml", ONE_STATIC), ": ", ("nothing can move",)),
    "nan": (mjcf("0 0 1", "0 0 nan"), ": position of 'ball'", ("finite",)),
    "entity": (mjcf("<mujoco", '<!DOCTYPE m [<!ENTITY a SYSTEM "/etc/passwd">]><mujoco'), ":1: ", ("DOCTYPE",)),
    "not closed": (mjcf("</mujoco>", ""), ":14: ", ("not valid XML",)),
    "no joint type": (("s.xml", HINGED), ": joint 'joint[0]'", ("not free",)),
    "two key frames": (mjcf("<key ", "<key/><key "), ":12: ", ("second <key>",)),
    "other root": (("s.xml", b"<sdf/>"), ":1: ", ("<mujoco> or <robot>",)),
    "binary": (("s.xml", b"\x00\x01\x02"), ":1: ", ("not valid XML",)),
    "empty": (("s.urdf", b" \n"), ":1: ", ("empty",)),
    "bad number": (mjcf('"0.1" mass', '"big" mass'), ":8: ", ("MuJoCo", "size")),
    "name repeated": (mjcf('"box" pos', '"ball" pos'), "", ("ball",)),
    "escape in a name": (mjcf('"ball"', '"ba&#x202e;ll"'), "", ("printable",)),
    "deep": (("s.xml", b"<mujoco>" + b"<default>" * 100 + b"</default>" * 100 + b"</mujoco>"), ":1: ", ("50",)),
    "urdf mesh": (urdf('<sphere radius="0.1"/>', '<mesh filename="a.stl"/>'), ":8: ", ("<mesh>",)),
    "urdf cylinder": (urdf('<sphere radius="0.1"/>', '<cylinder radius="1" length="1"/>'), ":8: ", ("<cylinder>",)),
    "urdf hinge": (urdf('type="floating"', 'type="revolute"'), ":10: ", ("<joint> 'loose'", "revolute")),
    "urdf friction": (urdf("<inertial>", "<contact/><inertial>"), ":4: ", ("<contact>",)),
    "urdf fixed": (urdf('"floating"', '"fixed"'), ": ", ("floating",)),
    "urdf transmission": (urdf("</robot>", "<transmission/></robot>"), ":11: ", ("<transmission>",)),
    "urdf extension": (urdf("</robot>", "<mujoco/></robot>"), ":11: ", ("<mujoco>",)),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_cannot_be_carried_over_is_named(kind: str, tmp_path: Path) -> None:
    (name, content), place, words = REFUSED[kind]
    check_refused(tmp_path, name, content, place, words)


def test_without_mujoco_there_is_one_clear_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(SceneError, match=r"^a\.xml: reading MJCF and URDF needs MuJoCo"):
        read(tmp_path, MJCF, "a.xml")


def test_limits_keep_scales_finite(tmp_path: Path) -> None:
    text = DROP.replace("mass = 1.0", f"mass = {LARGEST}\nvelocity = [0, 0, {LARGEST}]")
    scene = read(tmp_path, text)
    assert np.isfinite([scene.length, scene.speed, scene.energy]).all()
    assert replace(scene, name="x") != scene
