"""What an MJCF or URDF text may hold, checked before MuJoCo's parser sees it: everything else is refused by name.

Only what a scene has a counterpart for is on these lists, and no way to name another file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from xml.parsers import expat

from impactbench.scenarios.scene_values import SceneError, printable, shown

MOST_ELEMENTS = 100_000
DEEPEST = 50
_TURNED = "pos quat axisangle xyaxes zaxis euler"
_GEOM = f"name class type size fromto mass density friction condim contype conaffinity priority group rgba {_TURNED}"

MJCF: Mapping[str, str] = {
    "mujoco": "model",
    "compiler": "angle eulerseq autolimits inertiafromgeom",
    "option": "timestep gravity integrator cone jacobian solver iterations tolerance ls_iterations ls_tolerance "
    "noslip_iterations noslip_tolerance impratio",
    "default": "class",
    "worldbody": "",
    "body": f"name childclass {_TURNED}",
    "inertial": f"mass diaginertia fullinertia {_TURNED}",
    "freejoint": "name group",
    "joint": "name class type group",
    "geom": _GEOM,
    "contact": "",
    "pair": "name class geom1 geom2 condim friction",
    "keyframe": "",
    "key": "name time qpos qvel",
    "light": "name pos dir diffuse ambient specular directional castshadow active mode type",
    "camera": f"name mode fovy {_TURNED}",
}
URDF: Mapping[str, str] = {
    "robot": "name",
    "link": "name",
    "inertial": "",
    "origin": "xyz rpy",
    "mass": "value",
    "inertia": "ixx ixy ixz iyy iyz izz",
    "collision": "name",
    "visual": "name",
    "geometry": "",
    "sphere": "radius",
    "box": "size",
    "capsule": "radius length",
    "material": "name",
    "color": "rgba",
    "joint": "name type",
    "parent": "link",
    "child": "link",
}
GEOMS = ("plane", "sphere", "capsule", "box")
JOINTS = {"mujoco": ("free",), "robot": ("floating", "fixed")}


@dataclass
class _Reader:
    """Walks over the elements of a text in order."""

    file: str
    root: str = ""
    open: list[str] = field(default_factory=list)
    count: int = 0
    seen: dict[str, int] = field(default_factory=dict)
    parser: expat.XMLParserType = field(default_factory=expat.ParserCreate)

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self.count += 1
        if not self.open:
            self.root = tag
            if tag not in JOINTS:
                self.fail(f"expected <mujoco> or <robot>, got <{_short(tag)}>")
        self.open.append(tag)
        if self.count > MOST_ELEMENTS or len(self.open) > DEEPEST:
            self.fail(f"at most {MOST_ELEMENTS} elements, {DEEPEST} within one another")
        known = MJCF if self.root == "mujoco" else URDF
        what = f"<{_short(tag)}>{_named(attributes)}"
        if tag not in known:
            self.fail(f"{what} cannot be carried over")
        kinds = {"joint": JOINTS[self.root], "geom": GEOMS}.get(tag, ())
        kind = attributes.get("type", "")
        if kind and kinds and kind not in kinds:
            self.fail(f"{what} of type {_short(kind)} cannot be carried over; only {', '.join(kinds)}")
        for name in attributes:
            if name not in known[tag].split():
                self.fail(f"{_short(name)} of {what} cannot be carried over")
        self.once(tag)

    def once(self, tag: str) -> None:
        if tag in ("compiler", "option", "keyframe", "key"):
            self.seen[tag] = self.seen.get(tag, 0) + 1
            if self.seen[tag] > 1:
                self.fail(f"a second <{tag}> cannot be carried over")

    def end(self, _: str) -> None:
        self.open.pop()

    def doctype(self, *_: object) -> None:
        self.fail("<!DOCTYPE> is refused: it may name other files")

    def fail(self, why: str) -> None:
        raise SceneError(f"{self.file}:{self.parser.CurrentLineNumber}: {why}")


def check_xml(text: str, file: str) -> str:
    """Refuse what cannot be carried over; the root's name, `mujoco` or `robot`."""
    reader = _Reader(file)
    parser = reader.parser
    parser.StartElementHandler, parser.EndElementHandler = reader.start, reader.end
    parser.StartDoctypeDeclHandler = reader.doctype
    try:
        parser.Parse(text, True)
    except expat.ExpatError as why:
        raise SceneError(f"{file}:{why.lineno}: not valid XML: {expat.ErrorString(why.code)}") from None
    return reader.root


def _short(text: str) -> str:
    return printable(text[:60])


def _named(attributes: dict[str, str]) -> str:
    return f" {shown(attributes['name'])}" if "name" in attributes else ""
