"""Scenes from MJCF and URDF, read with MuJoCo's own parser so that defaults, angles and frames mean what they mean
there.

Carried over: spheres, boxes, capsules, planes, free bodies, gravity, friction, the start velocities of a key frame.
A body holds one geom with the centre of mass in its middle. MuJoCo states no bounciness: it is 0. URDF states no
friction either: it is 0.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from impactbench.scenarios import scene_defaults
from impactbench.scenarios.records import (
    ZERO,
    Body,
    Box,
    Capsule,
    Contact,
    HalfSpace,
    Quaternion,
    Scene,
    Shape,
    Sphere,
    Vector,
    uniform_inertia,
)
from impactbench.scenarios.scene_defaults import Content
from impactbench.scenarios.scene_values import LARGEST, SMALLEST, SceneError, printable, proper_name, shown
from impactbench.scenarios.scene_xml import check_xml
from impactbench.scenarios.trajectory import Floats

DURATION = 2.0
"""[s] Neither format states how long to run."""
MOST_PAIRS = 100_000
ROUND_OFF = 1e-9
FREE = 0
"""mjJNT_FREE"""


def imported_scene(text: str, file: str, title: str) -> Scene:
    """The scene of an MJCF or URDF text. Raises SceneError with the file and the name of what cannot be carried over.

    title: its name.
    """
    root = check_xml(text, file)
    return _Import(file, *_compiled(text, file)).scene(title, rough=root == "mujoco")


def _compiled(text: str, file: str) -> tuple[Any, Any]:
    """The compiled model and its state at t = 0."""
    try:
        import mujoco
    except ImportError:
        raise SceneError(f"{file}: reading MJCF and URDF needs MuJoCo, which is not installed here") from None
    mujoco.set_mju_user_warning(lambda _: None)  # else they go to a log file in the working directory
    try:
        model = mujoco.MjSpec.from_string(text).compile()
        data = mujoco.MjData(model)
        if model.nkey:
            mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
    except (ValueError, mujoco.FatalError) as why:
        raise SceneError(f"{file}:{_line(str(why))}: MuJoCo: {_one_line(why)}") from None
    return model, data


def _line(message: str) -> str:
    """MuJoCo ends its messages with `line 3`."""
    last = message.split("line ")[-1].split()
    return last[0].rstrip(",.") if last and last[0].rstrip(",.").isdigit() else "1"


def _one_line(why: Exception) -> str:
    return printable(" ".join(str(why).split()))[:300]


@dataclass(frozen=True)
class _Import:
    file: str
    model: Any
    data: Any

    def scene(self, title: str, rough: bool) -> Scene:
        geoms = self._ordered_geoms()
        bodies = tuple(self._body(geom) for geom in geoms)
        self._check_names(bodies)
        contact, pairs = self._contacts(geoms, bodies) if rough else (Contact(0.0), ())
        contacts = (contact, *(own for _, _, own in pairs))
        content = Content(bodies, self._vector(self.model.opt.gravity, "gravity"), DURATION, contacts)
        return scene_defaults.complete(title, content, contact, pairs)

    def fail(self, why: str) -> NoReturn:
        raise SceneError(f"{self.file}: {why}")

    def _ordered_geoms(self) -> list[int]:
        """Geoms of movable bodies first. A movable body holds exactly one."""
        static: list[int] = []
        moving: list[int] = []
        for geom, body in enumerate(self.model.geom_bodyid):
            (moving if self._moves(int(body)) else static).append(geom)
        holders = Counter(int(self.model.geom_bodyid[geom]) for geom in moving)
        for body in range(1, self.model.nbody):
            if self._moves(body) and holders[body] != 1:
                self.fail(f"body {self._name('body', body)} holds {holders[body]} geoms; one can be carried over")
        if not moving:
            self.fail("nothing can move: a body moves where a free (URDF: floating) joint connects it")
        if len(static) + len(moving) > scene_defaults.MOST_BODIES:
            self.fail(f"more than {scene_defaults.MOST_BODIES} bodies")
        return moving + static

    def _moves(self, body: int) -> bool:
        """Whether the body hangs on a joint; MuJoCo numbers the body that carries the joint as its weld's root."""
        root = int(self.model.body_weldid[body])
        if root == 0:
            return False
        joints = range(self.model.body_jntadr[root], self.model.body_jntadr[root] + self.model.body_jntnum[root])
        for joint in joints:
            if self.model.jnt_type[joint] != FREE:
                self.fail(f"joint {self._name('joint', joint)} is not free: it cannot be carried over")
        if root != body:
            self.fail(f"body {self._name('body', body)} is fixed to one that moves: it cannot be carried over")
        return True

    def _name(self, kind: str, index: int) -> str:
        return shown(getattr(self.model, kind)(index).name or f"{kind}[{index}]")

    def _body(self, geom: int) -> Body:
        body = int(self.model.geom_bodyid[geom])
        own, bearer = self.model.geom(geom).name, self.model.body(body).name
        name = own or (f"geom[{geom}]" if body == 0 else bearer) or f"geom[{geom}]"
        position = self._vector(self.data.geom_xpos[geom], f"position of {shown(name)}")
        turn = self.data.geom_xmat[geom].reshape(3, 3)
        shape = self._shape(geom, turn, name)
        orientation = self._orientation(geom, body) if not isinstance(shape, HalfSpace) else (1.0, 0.0, 0.0, 0.0)
        if not self._moves(body):
            return Body(name, shape, None, position, orientation=orientation)
        mass = float(self.model.body_mass[body])
        self._check_centre(geom, body, name)
        inertia = self._inertia(geom, body, shape, mass, name)
        velocity, spin = self._motion(body)
        return Body(name, shape, mass, position, velocity, orientation, spin, inertia)

    def _shape(self, geom: int, turn: Floats, name: str) -> Shape:
        kind = str(_geom_kind(int(self.model.geom_type[geom])))
        size = self._vector(self.model.geom_size[geom], f"size of {shown(name)}")
        makers: dict[str, Callable[[], Shape]] = {
            "plane": lambda: HalfSpace(self._vector(turn[:, 2], "normal")),
            "sphere": lambda: Sphere(size[0]),
            "capsule": lambda: Capsule(size[0], size[1]),
            "box": lambda: Box(size),
        }
        if kind not in makers:
            self.fail(f"geom {shown(name)} is of type {kind}: it cannot be carried over")
        return makers[kind]()

    def _orientation(self, geom: int, body: int) -> Quaternion:
        import mujoco

        quat = np.zeros(4)
        mujoco.mju_mulQuat(quat, self.data.xquat[body], self.model.geom_quat[geom])
        w, x, y, z = (float(value) for value in quat / np.linalg.norm(quat))
        return (w, x, y, z)

    def _check_centre(self, geom: int, body: int, name: str) -> None:
        away = float(np.abs(self.model.geom_pos[geom] - self.model.body_ipos[body]).max())
        size = float(self.model.geom_rbound[geom])
        if away > ROUND_OFF * size:
            self.fail(
                f"body {shown(name)}: its centre of mass is not the middle of its geom: it cannot be carried over"
            )

    def _inertia(self, geom: int, body: int, shape: Shape, mass: float, name: str) -> Vector | None:
        """Principal moments along the geom's axes; None where they are those of uniform density."""
        turn = _matrix(self.model.geom_quat[geom]).T @ _matrix(self.model.body_iquat[body])
        tensor = turn @ np.diag(self.model.body_inertia[body]) @ turn.T
        moments = np.diag(tensor)
        if np.abs(tensor - np.diag(moments)).max() > ROUND_OFF * moments.max():
            self.fail(f"body {shown(name)}: its inertia is not along its geom's axes: it cannot be carried over")
        if np.allclose(moments, uniform_inertia(shape, mass), rtol=ROUND_OFF, atol=0):
            return None
        return self._vector(moments, f"inertia of {shown(name)}")

    def _motion(self, body: int) -> tuple[Vector, Vector]:
        """Velocity of the centre of mass and spin, world axes. A free joint states the spin in the body's axes."""
        if not self.model.nkey:
            return ZERO, ZERO
        first = int(self.model.jnt_dofadr[self.model.body_jntadr[body]])
        rates = self.model.key_qvel[0][first : first + 6]
        spin = self.data.xmat[body].reshape(3, 3) @ rates[3:]
        velocity = rates[:3] + np.cross(spin, self.data.xipos[body] - self.data.xpos[body])
        return self._vector(velocity, "qvel"), self._vector(spin, "qvel")

    def _vector(self, values: Any, what: str) -> Vector:
        x, y, z = (float(value) for value in values)
        if not all(abs(value) <= LARGEST for value in (x, y, z)):
            self.fail(f"{what} is not finite or above {LARGEST:g}")
        return (x, y, z)

    def _check_names(self, bodies: tuple[Body, ...]) -> None:
        names: set[str] = set()
        for body in bodies:
            try:
                proper_name(body.name)
            except ValueError as why:
                self.fail(f"body {shown(body.name)}: {why}")
            if body.name in names:
                self.fail(f"two bodies are named {shown(body.name)}")
            names.add(body.name)
            if body.mass is not None and not SMALLEST <= body.mass <= LARGEST:
                self.fail(f"body {shown(body.name)}: its mass {body.mass:g} is out of range")

    def _contacts(
        self, geoms: list[int], bodies: tuple[Body, ...]
    ) -> tuple[Contact, tuple[tuple[str, str, Contact], ...]]:
        """Coefficients as MuJoCo combines them: of the higher priority, else the larger of the two."""
        own = {geom: self._surface(geom, body) for geom, body in zip(geoms, bodies, strict=True)}
        listed = self._listed_pairs()
        if len(set(own.values())) == 1 and not listed:
            return Contact(0.0, _friction(own[geoms[0]], own[geoms[0]])), ()
        movable = sum(not body.static for body in bodies)
        if movable * len(bodies) > MOST_PAIRS:
            self.fail(f"more than {MOST_PAIRS} pairs of surfaces that differ")
        pairs = []
        for n, a in enumerate(geoms[:movable]):
            for m in range(n + 1, len(geoms)):
                b = geoms[m]
                friction = listed.get(frozenset((a, b)), _friction(own[a], own[b]))
                pairs.append((bodies[n].name, bodies[m].name, Contact(0.0, friction)))
        return pairs[0][2] if pairs else Contact(0.0), tuple(pairs)

    def _surface(self, geom: int, body: Body) -> tuple[int, int, float]:
        """Priority, dimension and sliding friction of a geom."""
        masks = int(self.model.geom_contype[geom]), int(self.model.geom_conaffinity[geom])
        if not masks[0] & masks[1] & 1:
            self.fail(f"{shown(body.name)}: contype and conaffinity other than 1 cannot be carried over")
        condim = int(self.model.geom_condim[geom])
        if condim > 3:
            self.fail(f"{shown(body.name)}: condim {condim} (spinning or rolling friction) cannot be carried over")
        return int(self.model.geom_priority[geom]), condim, float(self.model.geom_friction[geom][0])

    def _listed_pairs(self) -> dict[frozenset[int], float]:
        listed = {}
        for pair in range(self.model.npair):
            condim, friction = int(self.model.pair_dim[pair]), self.model.pair_friction[pair]
            if condim > 3 or friction[0] != friction[1]:
                self.fail(
                    f"pair {self._name('pair', pair)}: friction other than one Coulomb cone cannot be carried over"
                )
            geoms = frozenset((int(self.model.pair_geom1[pair]), int(self.model.pair_geom2[pair])))
            listed[geoms] = float(friction[0]) if condim > 1 else 0.0
        return listed


def _friction(a: tuple[int, int, float], b: tuple[int, int, float]) -> float:
    if a[0] != b[0]:
        chosen = max(a, b)
        return chosen[2] if chosen[1] > 1 else 0.0
    return max(a[2], b[2]) if max(a[1], b[1]) > 1 else 0.0


def _geom_kind(number: int) -> str:
    import mujoco

    return str(mujoco.mjtGeom(number).name).removeprefix("mjGEOM_").lower()


def _matrix(quaternion: Any) -> Floats:
    import mujoco

    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, quaternion)
    return flat.reshape(3, 3)
