"""What a cell's figures depend on besides its description: our text, the contestant's, and the packages they import."""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import platform
import sys
import sysconfig
from collections.abc import Iterable, Iterator
from functools import cache
from importlib import metadata
from importlib.machinery import ModuleSpec
from pathlib import Path

from impactbench.adapters.contestants import Contestant

MEASURING = "impactbench.reports.cell"
"""The module whose imports hold everything that turns a cell into figures."""
INSTALLED = tuple(Path(sysconfig.get_path(kind)) for kind in ("purelib", "platlib"))


@cache
def fingerprint(contestant: Contestant) -> str:
    """Changes whenever something changes that this contestant's figures could depend on, on this machine.

    That is the text of every module reached by imports from the measuring code and from the contestant's own module,
    the versions of the installed packages these import, Python's version and the kind of processor. Files that an
    engine opens by a path of its own are not seen.
    """
    texts: dict[str, str] = {}
    packages: set[str] = set()
    for root in (MEASURING, contestant.factory.rpartition(":")[0]):
        _follow(root, texts, packages)
    versions = sorted((package, _version(package)) for package in packages | {contestant.distribution} - {""})
    parts = (sorted(texts.items()), versions, platform.python_version(), platform.machine())
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def _follow(root: str, texts: dict[str, str], packages: set[str]) -> None:
    """Add the digest of each of our own or the user's modules to `texts`, each package of others to `packages`."""
    own = {"impactbench", root.partition(".")[0]}
    todo = [root]
    while todo:
        name = todo.pop()
        path = Path(name) if name.endswith(".py") else _origin(name, own, packages)
        known = path.name if path and name.endswith(".py") else name
        if path is None or known in texts:
            continue
        try:
            content = path.read_bytes()
        except OSError:  # a module that is not there fails its own cells, with its reason
            continue
        texts[known] = hashlib.sha256(content).hexdigest()
        if path.suffix == ".py":
            package = name if path.name == "__init__.py" else name.rpartition(".")[0]
            todo += _imports(content, "" if name.endswith(".py") else package)


def _origin(name: str, own: set[str], packages: set[str]) -> Path | None:
    """The file of a module; None for one of the standard library or of an installed package, which is noted."""
    top = name.partition(".")[0]
    if top in sys.stdlib_module_names:
        return None
    if top not in own:
        spec = _spec(top)
        if spec is None or spec.origin is None or any(Path(spec.origin).is_relative_to(place) for place in INSTALLED):
            packages.add(top)
            return None
    spec = _spec(name)
    return Path(spec.origin) if spec and spec.origin else None


@cache
def _spec(name: str) -> ModuleSpec | None:
    parent = name.rpartition(".")[0]
    if parent and not ((spec := _spec(parent)) and spec.submodule_search_locations):
        return None  # an attribute of a module; asking for it would import that module
    try:
        return importlib.util.find_spec(name)
    except (ImportError, ValueError, AttributeError):
        return None


def _imports(content: bytes, package: str) -> Iterator[str]:
    """Every module a text may import, wherever the statement stands; names that may be modules or attributes too."""
    try:
        tree = ast.parse(content)
    except (SyntaxError, ValueError):
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from _with_parents(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(package.split(".")[: len(package.split(".")) - node.level + 1]) if node.level else ""
            module = ".".join(part for part in (base, node.module or "") if part)
            if module:
                yield from _with_parents([module])
                yield from (f"{module}.{alias.name}" for alias in node.names)


def _with_parents(names: Iterable[str]) -> Iterator[str]:
    for name in names:
        parts = name.split(".")
        yield from (".".join(parts[:count]) for count in range(1, len(parts) + 1))


def _version(package: str) -> str:
    """Version of the distribution that brings this import name; empty where none does."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        names = _distributions().get(package, [])
        return " ".join(metadata.version(name) for name in sorted(set(names)))


@cache
def _distributions() -> dict[str, list[str]]:
    return dict(metadata.packages_distributions())
