"""MuJoCo: contacts as soft constraints, v before x (Euler), any subset of axes through joints.

Pair coefficients: explicit <pair> elements where coefficients differ or friction needs its own reference; else they are
set on geoms. Restitution has no parameter of its own. The tuned profile makes a contact answer within one step: with
stiffness K ~ 0 and damping B = (1+e)/h the reference acceleration -B v over one step turns v into -e v (Euler and
implicit integrators only).
Cannot express: viscous friction on planes that are oblique to the axes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np
from impactbench.adapters.frames import about, multiply, rotate
from impactbench.adapters.surfaces import (
    ROUND_OFF,
    can_meet,
    distinct_contacts,
    gravity_of,
    moving_axes,
    need,
    viscous_rates,
)
from impactbench.scenarios.engine import Unavailable, Unsupported
from impactbench.scenarios.records import Body, Box, Capsule, Contact, HalfSpace, Law, Model, Scene, Sphere
from impactbench.scenarios.trajectory import Floats, State

try:
    import mujoco as mj
except ImportError as error:
    raise Unavailable(f"mujoco cannot be imported: {error}") from error

INTEGRATORS = {
    "tuned": "Euler",
    "stiff": "Euler",
    "cushion": "Euler",
    "speculative": "Euler",
    "implicit": "implicit",
    "implicitfast": "implicitfast",
    "rk4": "RK4",
}
"""By profile. `stiff` and `cushion` answer every contact with the stiff spring of piles or the softer one (see
`_normal`), whatever the scene's need; `speculative` adds the flag of that name, contacts before bodies touch, against
tunnelling (MuJoCo 4.0, XML reference, option/flag). The last three are for `reproduce`, of flights: one-step impacts
need a step of one stage."""
STIFF, CUSHION = "{!r} 1", "{!r} {!r}"
"""solref: the shortest time constant MuJoCo advises (2 h, critically damped; XML reference, solref), or a spring that
takes back a fiftieth of an overlap per step while the damper stops the approach in one."""
RIGID = "0.9999 0.9999 0.001 0.5 2"
"""solimp: constant impedance, or e would depend on depth."""
WORDS = {
    "integrator": (mj.mjtIntegrator, "mjINT_"),
    "cone": (mj.mjtCone, "mjCONE_"),
    "solver": (mj.mjtSolver, "mjSOL_"),
    "jacobian": (mj.mjtJacobian, "mjJAC_"),
}
"""Options whose values have names."""
LOST = tuple(int(w) for w in (mj.mjtWarning.mjWARN_BADQPOS, mj.mjtWarning.mjWARN_BADQVEL, mj.mjtWarning.mjWARN_BADQACC))
FULL_BUFFERS = tuple(int(w) for w in (mj.mjtWarning.mjWARN_CONTACTFULL, mj.mjtWarning.mjWARN_CNSTRFULL))


class MuJoCo:
    def __init__(self, scene: Scene, law: Law, profile: str, model: Model, step: float) -> None:
        self._scene, self._model, self._h = scene, model, step
        self._profile = profile
        self._tuned, self._integrator = profile in INTEGRATORS, INTEGRATORS.get(profile, "Euler")
        self._rates = viscous_rates(scene, law, profile)
        self._axes = moving_axes(scene, model)
        self._pairs = can_meet(scene, self._axes)
        self._contacts = distinct_contacts(scene, self._pairs)
        self._need = need(scene, model, self._contacts)
        self._free = model.rotation and self._axes == (0, 1, 2) and not self._rates
        self._settings: dict[str, object] = {}
        # Else every warning is appended to a log file in the working directory; the counters in `warning` tell as much.
        mj.set_mju_user_warning(lambda _: None)
        self._m = mj.MjModel.from_xml_string(self._xml())
        self._d = mj.MjData(self._m)
        self._warnings = self._d.warning.number  # a view: asking for each by name takes longer than a step
        movable = [scene.bodies[i] for i in scene.movable]
        self._start = np.array([b.position for b in movable], dtype=float).reshape(-1, 3)
        self._turned = np.array([b.orientation for b in movable], dtype=float).reshape(-1, 4)
        self._set_velocities(movable)

    @property
    def settings(self) -> Mapping[str, object]:
        return self._settings

    def configure(self, settings: Mapping[str, object]) -> None:
        """Options of the solver by their own names, on top of the profile's."""
        for name, value in settings.items():
            kind, prefix = WORDS.get(name, (None, ""))
            setattr(self._m.opt, name, value if kind is None else int(getattr(kind, prefix + str(value).upper())))
        self._settings |= settings

    def advance(self, steps: int) -> None:
        mj.mj_step(self._m, self._d, steps)

    def read(self) -> State:
        warnings = self._warnings.tolist()
        if any(warnings[w] for w in FULL_BUFFERS):
            raise RuntimeError("MuJoCo ran out of contact or constraint memory")
        n, k = len(self._start), len(self._axes)
        q, u = self._d.qpos.reshape(n, -1), self._d.qvel.reshape(n, -1)
        x, v = self._start.copy(), np.zeros((n, 3))
        if self._free:
            x[:] = q[:, :3]
        else:
            x[:, self._axes] += q[:, :k]
        v[:, self._axes] = u[:, :k]
        if any(warnings[w] for w in LOST):
            # On a bad number the engine puts the whole world back to its start: that must not pass for a state.
            x[:], v[:] = math.nan, math.nan
        if not self._model.rotation:
            return State(x, v)
        turn, spin = self._turns(q[:, k:], u[:, k:])
        return State(x, v, multiply(turn, self._turned), spin)

    def close(self) -> None:
        del self._warnings, self._d, self._m

    def _turns(self, q: Floats, u: Floats) -> tuple[Floats, Floats]:
        """Turns since t = 0 and world spins. A hinge is an angle; ball and free joints spin in the turned frame."""
        if len(self._axes) == 2:
            across = 3 - sum(self._axes)
            spin = np.zeros((len(u), 3))
            spin[:, across] = u[:, 0]
            return about(across, q[:, 0]), spin
        return q.copy(), rotate(q, u)

    def _set_velocities(self, movable: list[Body]) -> None:
        n, k = len(movable), len(self._axes)
        u = self._d.qvel.reshape(n, -1)
        u[:, :k] = np.array([b.velocity for b in movable]).reshape(-1, 3)[:, self._axes]
        if self._model.rotation:
            spins = np.array([b.spin for b in movable]).reshape(-1, 3)
            u[:, k:] = spins[:, [3 - sum(self._axes)]] if k == 2 else spins

    def _xml(self) -> str:
        option = {"timestep": repr(self._h), "gravity": _words(gravity_of(self._scene, self._model))}
        flag = ""
        if self._tuned:
            # RK4 solves a damped slide to 1e-11, but its stages spoil one-step impacts.
            integrator = "RK4" if self._rates else self._integrator
            chosen = {"integrator": integrator, "cone": "elliptic", "tolerance": "1e-15"}
            option |= chosen
            self._settings |= chosen | {"autoreset": "disable"}
            ahead = ' speculative="enable"' if self._profile == "speculative" else ""
            flag = f'<flag autoreset="disable"{ahead}/>'
            self._settings |= {"speculative": "enable"} if ahead else {}
        else:
            self._settings["restitution"] = "none in MuJoCo; default solref (0.02, 1)"
            self._settings["cone"] = "not set (pyramidal: friction depends on the heading)"
        listed = (self._tuned and self._need == "sliding") or len(self._contacts) > 1
        listed = listed or (self._tuned and self._rough() and self._need == "impacts")
        self._settings["coefficients"] = "per pair" if listed else "per geom (all pairs are alike)"
        alike = next(iter(self._contacts), None)
        touching = "" if alike is None or listed else _attributes(self._contact(alike, False))
        met = {i for pair in self._pairs for i in pair}
        bodies = "".join(
            self._body(i, touching if i in met and touching else 'contype="0" conaffinity="0"')
            for i in (*self._scene.statics, *self._scene.movable)
        )
        pairs = "".join(self._pair(a, b) for a, b in self._pairs) if listed else ""
        return (
            f"<mujoco><option {_attributes(option)}>{flag}</option>"
            f"<worldbody>{bodies}</worldbody><contact>{pairs}</contact></mujoco>"
        )

    def _rough(self) -> bool:
        return self._model.friction and not self._rates and any(c.friction for c in self._contacts)

    def _contact(self, contact: Contact, listed: bool) -> dict[str, str]:
        """Attributes of a geom, or of a listed pair."""
        mu = contact.friction if self._rough() else 0.0
        chosen = {"condim": "3" if mu else "1"}
        if mu:
            chosen["friction"] = f"{mu!r} {mu!r} 0 0 0" if listed else f"{mu!r} 0 0"
        if not self._tuned:
            return chosen
        chosen |= {"solref": self._normal(contact.bounciness), "solimp": RIGID}
        if listed and mu:
            chosen["solreffriction"] = f"-1e-12 {-self._grip(mu)!r}"
        self._settings |= {name: chosen[name] for name in ("solref", "solimp", "solreffriction") if name in chosen}
        return chosen

    def _normal(self, e: float) -> str:
        if self._profile == "stiff":
            return STIFF.format(2 * self._h)
        if self._profile == "cushion":
            return CUSHION.format(-0.02 / self._h**2, -1 / self._h)
        if self._need != "resting":
            return f"-1e-12 {-(1 + e) / self._h!r}"
        # Piles need overlaps pushed out. The stiff spring does it better, but throws piles up at coarse steps.
        return STIFF.format(2 * self._h) if self._h < 0.01 else CUSHION.format(-0.02 / self._h**2, -1 / self._h)

    def _grip(self, mu: float) -> float:
        """Damping [1/s] of slip: 1/h sticks within one step, as an impact needs, but makes lasting contacts hop.

        Below the speed mu g/grip a slide fades instead of stopping, which adds (mu g/(grip v))^2 of its length; this
        grip makes that as large as the integrator's own mu g h/v, and the hops small.
        """
        if self._need != "sliding":
            return 1 / self._h
        weight = mu * math.hypot(*gravity_of(self._scene, self._model))
        return min(1 / self._h, math.sqrt(weight / (self._scene.speed * self._h)))

    def _pair(self, a: int, b: int) -> str:
        attributes = self._contact(self._scene.contact_of(a, b), True)
        return f'<pair geom1="g{a}" geom2="g{b}" {_attributes(attributes)}/>'

    def _body(self, i: int, contact: str) -> str:
        body = self._scene.bodies[i]
        placed = "" if not body.static else f'pos="{_words(body.position)}"'
        turned = "" if isinstance(body.shape, HalfSpace) else f'quat="{_words(body.orientation)}"'
        geom = f'<geom name="g{i}" {placed} {turned} {_shape(body)} {contact}/>'
        if body.static:
            return geom
        # The frame starts upright and the turn sits inside: joint axes are then the world's.
        mass = f'mass="{body.mass!r}" diaginertia="{_words(body.principal_inertia())}"'
        inside = f'<inertial pos="0 0 0" quat="{_words(body.orientation)}" {mass}/>'
        return f'<body pos="{_words(body.position)}">{inside}{self._joints(i)}{geom}</body>'

    def _joints(self, i: int) -> str:
        if self._free:
            return "<freejoint/>"
        damping = self._damping(i)
        slides = "".join(f'<joint type="slide" axis="{_axis(k)}" damping="{damping[k]!r}"/>' for k in self._axes)
        if not self._model.rotation:
            return slides
        across = 3 - sum(self._axes)
        return slides + (
            f'<joint type="hinge" axis="{_axis(across)}"/>' if len(self._axes) == 2 else '<joint type="ball"/>'
        )

    def _damping(self, i: int) -> list[float]:
        """c along the axes that lie in the plane the body slides on."""
        if i not in self._rates:
            return [0.0] * 3
        partner = next(a for a in self._scene.statics if self._scene.contact_of(a, i).viscosity > 0)
        shape = self._scene.bodies[partner].shape
        normal = shape.normal if isinstance(shape, HalfSpace) else None
        if normal is None or max(map(abs, normal)) < 1 - ROUND_OFF:
            raise Unsupported("MuJoCo damps along joint axes; this body does not slide on a plane square to them")
        self._settings["joint damping"] = self._rates[i]
        return [0.0 if abs(n) > 0.5 else self._rates[i] for n in normal]


def _shape(body: Body) -> str:
    match body.shape:
        case Sphere(radius):
            return f'type="sphere" size="{radius!r}"'
        case Box(half):
            return f'type="box" size="{_words(half)}"'
        case Capsule(radius, half):
            return f'type="capsule" size="{radius!r} {half!r}"'
        case HalfSpace(normal):
            return f'type="plane" size="0 0 1" zaxis="{_words(normal)}"'


def _axis(k: int) -> str:
    return " ".join("1" if j == k else "0" for j in range(3))


def _words(numbers: Iterable[float]) -> str:
    return " ".join(repr(float(x)) for x in numbers)


def _attributes(attributes: Mapping[str, str]) -> str:
    return " ".join(f'{name}="{value}"' for name, value in attributes.items())
