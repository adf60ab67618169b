"""The table of contestants by dotted name. Nothing heavy is imported before `load`."""

from __future__ import annotations

import difflib
import importlib
import importlib.metadata
import importlib.util
import platform
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import cache, partial
from pathlib import Path
from typing import Any, cast

from impactbench.adapters import policies
from impactbench.scenarios.engine import Engine, Unavailable
from impactbench.scenarios.records import Law


class UnknownContestant(ValueError):
    """A filter that names no contestant, or two that cannot be told apart."""


@dataclass(frozen=True)
class Contestant:
    engine: str
    profile: str
    factory: str  # "package.module:Class" or "path/to/file.py:Class"
    distribution: str = ""  # the installed package that carries it; none for a user's own engine
    law: Law = "nc"
    stepless: bool = False  # goes from event to event: a step is only how often it is read
    options: policies.Options = ()  # solver settings on top of the profile

    @property
    def name(self) -> str:
        return f"{self.engine}/{self.profile}{policies.suffix(self.options)}"

    @property
    def lane(self) -> str:
        """Contestants of one lane may share a child process."""
        return self.engine

    def version(self) -> str | None:
        return _version(self.distribution) if self.distribution else None

    def availability(self) -> str:
        """Empty, or why it cannot run here; from metadata alone, so that a broken engine cannot break the question."""
        if not self.distribution or self.version() is not None:
            return ""
        return _why_missing(self.distribution, sys.version_info[:2], sys.platform, platform.machine())

    def load(self) -> type[Engine]:
        module, _, name = self.factory.rpartition(":")
        try:
            found = _import_file(Path(module)) if module.endswith(".py") else importlib.import_module(module)
            kind = getattr(found, name)
            return cast(type[Engine], partial(_configured, kind, dict(self.options)) if self.options else kind)
        except (ImportError, OSError, AttributeError) as fault:  # OSError: a shared library that does not load
            raise Unavailable(self.availability() or f"{self.name} cannot be loaded: {fault}") from fault


@cache  # reading it takes a millisecond, and every cell asks
def _version(distribution: str) -> str | None:
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return None


def _configured(kind: Any, options: dict[str, policies.Value], *scene_and_step: Any) -> Engine:
    """A world of this kind with solver settings changed once it is built."""
    engine: Any = kind(*scene_and_step)
    engine.configure(options)
    return cast(Engine, engine)


CONTESTANTS = (
    Contestant("reference", "stepped", "impactbench.reference.contestant:Stepped", "impactbench", "doc"),
    Contestant(
        "reference", "exact", "impactbench.reference.exact_contestant:Exact", "impactbench", "doc", stepless=True
    ),
    *(
        Contestant(engine, profile, f"impactbench.adapters.{engine}_adapter:{name}", engine)
        for engine, name in (("pybullet", "Bullet"), ("mujoco", "MuJoCo"), ("pymunk", "Pymunk"))
        for profile in ("default", "tuned")
    ),
)


def _policy(engine: str, profile: str) -> Contestant:
    return replace(next(known for known in CONTESTANTS if known.engine == engine), profile=profile)


_PROFILES = tuple(
    _policy(engine, profile)
    for engine, profile in (
        ("reference", "revert"),
        ("reference", "force"),
        ("reference", "positions"),
        ("pybullet", "iterations"),
        ("pybullet", "swept"),
        ("pybullet", "maximal"),
        ("pybullet", "multibody"),
        ("mujoco", "stiff"),
        ("mujoco", "cushion"),
        ("mujoco", "speculative"),
        ("mujoco", "implicit"),
        ("mujoco", "implicitfast"),
        ("mujoco", "rk4"),
        ("pymunk", "iterations"),
        ("pymunk", "substeps"),
    )
)


def _with_options(text: str) -> Contestant:
    """The contestant that a name with settings means. Raises UnknownContestant in one line."""
    try:
        base, options = policies.parse(text)
    except ValueError as error:
        raise UnknownContestant(str(error)) from None
    return replace(next(known for known in (*CONTESTANTS, *_PROFILES) if known.name == base), options=options)


POLICIES = (*_PROFILES, *(_with_options(name) for name in policies.option_policies()))
"""Further settings, which take part when named in full or with `--profile all`; `policies.SOURCES` says whence."""

GROUP = "impactbench.engines"
"""Entry points of this group are engines that other installed packages offer."""
HINT = "installed; takes part when asked for by name"


def installed() -> tuple[Contestant, ...]:
    """Engines of installed packages, each `NAME/default`; from metadata alone. A name of ours stays ours."""
    points = importlib.metadata.entry_points(group=GROUP)
    return tuple(
        # The value may end in extras: "module:Class [extra]".
        Contestant(point.name, "default", point.value.partition("[")[0].strip(), point.dist.name if point.dist else "")
        for point in sorted(points, key=lambda point: point.name)
        if point.name not in _distinct("engine")
    )


def select(engines: Sequence[str] = (), profiles: Sequence[str] = ()) -> tuple[Contestant, ...]:
    """The contestants that match one of `engines` and one of `profiles`; an empty filter lets all pass.

    `engines` holds engines ("mujoco"), contestants ("mujoco/tuned"), globs of either, or a user's own engine
    ("file.py:Name", "module:Name"), which becomes `Name/default`, or the name of an installed one (see `installed`);
    these pass whatever the profiles, and only when asked for. So do contestants with settings
    ("mujoco/tuned:iterations=20"), and those of a file ("policies.toml").
    """
    engines = [name for text in engines for name in (_of_file(text) if text.endswith(".toml") else [text])]
    own = [_with_options(text) if policies.is_policy(text) else _own(text) for text in engines if ":" in text]
    filters = [text for text in engines if ":" not in text]
    for text in filters:
        if any(_matches(contestant, text) for contestant in CONTESTANTS):
            continue
        others = installed()
        named = [policy for policy in POLICIES if text == policy.name]
        named += [contestant for contestant in others if text in (contestant.engine, contestant.name)]
        if not named:
            extra = [*(policy.name for policy in POLICIES), *(contestant.engine for contestant in others)]
            known = [*_distinct("engine"), *_distinct("name"), *extra]
            raise _unknown("contestant", text, known)
        own += named
    for text in profiles:
        if not any(fnmatchcase(contestant.profile, text) for contestant in CONTESTANTS):
            raise _unknown("profile", text, _distinct("profile"))
    chosen = [c for c in CONTESTANTS if any(_matches(c, text) for text in filters) or not engines]
    chosen = [c for c in chosen if any(fnmatchcase(c.profile, text) for text in profiles) or not profiles]
    if not chosen and not own:
        raise UnknownContestant(f"no contestant is both {' or '.join(engines)} and {' or '.join(profiles)}")
    return _without_doubles([*chosen, *own])


def with_policies(engines: Sequence[str] = ()) -> tuple[Contestant, ...]:
    """What `select` gives, and every policy of the table of the engines asked for."""
    chosen = select(engines)
    whole = {text for text in engines if "/" not in text and ":" not in text}
    more = [policy for policy in POLICIES if not engines or any(_matches(policy, text) for text in whole)]
    return _without_doubles([*chosen, *more])


def _of_file(text: str) -> list[str]:
    try:
        return policies.read(Path(text))
    except ValueError as error:
        raise UnknownContestant(str(error)) from None


def _matches(contestant: Contestant, text: str) -> bool:
    return fnmatchcase(contestant.name if "/" in text else contestant.engine, text)


def _distinct(field: str) -> list[str]:
    return list(dict.fromkeys(str(getattr(contestant, field)) for contestant in CONTESTANTS))


def _unknown(kind: str, text: str, known: list[str]) -> UnknownContestant:
    near = difflib.get_close_matches(text, known, 1)
    hint = f"did you mean {near[0]}? " if near else ""
    return UnknownContestant(f"unknown {kind} {text!r}; {hint}known: {', '.join(known)}")


def _own(text: str) -> Contestant:
    module, _, name = text.rpartition(":")
    if not module or not name.isidentifier():
        raise UnknownContestant(f"{text!r} is not of the form file.py:Name or module:Name")
    if module.endswith(".py"):
        if not Path(module).is_file():
            raise UnknownContestant(f"{text!r}: no such file")
        module = str(Path(module).resolve())
    return Contestant(name, "default", f"{module}:{name}")


def _without_doubles(contestants: list[Contestant]) -> tuple[Contestant, ...]:
    by_name: dict[str, Contestant] = {}
    for contestant in contestants:
        if by_name.setdefault(contestant.name, contestant) != contestant:  # results are keyed by name
            other = by_name[contestant.name].factory
            raise UnknownContestant(f"{other} and {contestant.factory} are both named {contestant.name}")
    return tuple(by_name.values())


def _why_missing(distribution: str, python: tuple[int, int], system: str, machine: str) -> str:
    if distribution == "pybullet" and (python >= (3, 12) or (system, machine) != ("linux", "x86_64")):
        return f"no pybullet wheel for Python {python[0]}.{python[1]} on {system} {machine}"
    return f"{distribution} is not installed"


def _import_file(path: Path) -> object:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} is not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules.setdefault(path.stem, module)  # dataclasses look their module up; never hide one that is there
    spec.loader.exec_module(module)
    return module
