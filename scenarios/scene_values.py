"""Reading checked values out of a parsed table. Every complaint is one line that gives file, line and key."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NoReturn

from impactbench.scenarios.records import Vector
from impactbench.scenarios.scene_lines import Path

LARGEST, SMALLEST = 1e30, 1e-30
"""Beyond these, squares and products of numbers leave the range of floats."""
LONGEST_NAME = 200


class SceneError(ValueError):
    """A scene file that cannot be used: one line with the place and the reason."""


def printable(text: str) -> str:
    """The text with each control character, bidirectional mark and the like replaced by a question mark."""
    return "".join(c if c.isprintable() else "?" for c in text)


def shown(value: object) -> str:
    """A value as a message may quote it."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def nearest(word: str, known: Iterable[str]) -> str:
    """`; nearest: mass` or, where nothing is near, the known words."""
    words = list(known)
    close = difflib.get_close_matches(word[:LONGEST_NAME], words, n=1)
    return f"nearest: {close[0]}" if close else f"known: {', '.join(words)}"


def proper_name(text: object) -> str:
    """The name, or ValueError with what is wrong with it. HTML is only text here."""
    if not isinstance(text, str):
        raise ValueError(f"expected text, got {shown(text)}")
    if not text.strip() or len(text) > LONGEST_NAME:
        raise ValueError(f"a name has 1 to {LONGEST_NAME} characters, got {len(text)}")
    if not text.isprintable():
        raise ValueError(f"a name holds printable characters only, got {shown(text)}")
    return text


@dataclass(frozen=True)
class Table:
    """A table of the file with the place it stands at."""

    file: str
    values: Mapping[str, Any]
    lines: Mapping[Path, int] = field(repr=False)
    path: Path = ()

    def fail(self, why: str, *key: str | int) -> NoReturn:
        path = (*self.path, *key)
        known = next(path[:n] for n in range(len(path), -1, -1) if path[:n] in self.lines)
        where = f"{_dotted(path)}: " if path else ""
        raise SceneError(f"{self.file}:{self.lines[known]}: {where}{why}")

    def only(self, known: Sequence[str], of: str) -> None:
        """Refuse every key but these."""
        for key in self.values:
            if key not in known:
                self.fail(f"{of} has no such key; {nearest(key, known)}", key)

    def get(self, key: str) -> Any:
        if key not in self.values:
            self.fail(f"{key} is missing")
        return self.values[key]

    def tables(self, key: str) -> list[Table]:
        values = self.values.get(key, [])
        if not isinstance(values, list):
            self.fail(f"expected tables [[{key}]], got {shown(values)}", key)
        return [self._table(value, key, i) for i, value in enumerate(values)]

    def table(self, key: str) -> Table:
        return self._table(self.values.get(key, {}), key)

    def _table(self, value: Any, *key: str | int) -> Table:
        if not isinstance(value, dict):
            self.fail(f"expected a table, got {shown(value)}", *key)
        return Table(self.file, value, self.lines, (*self.path, *key))

    def checked(self, key: str, check: Callable[[Any], Any]) -> Any:
        """What `check` makes of the value; its ValueError becomes a complaint with the place."""
        value = self.get(key)
        try:
            return check(value)
        except SceneError:
            raise
        except ValueError as why:
            self.fail(str(why), key)

    def number(self, key: str, default: float | None = None) -> float:
        if default is not None and key not in self.values:
            return default
        return float(self.checked(key, as_number))

    def positive(self, key: str) -> float:
        return float(self.checked(key, as_positive))

    def between(self, key: str, default: float, low: float, high: float) -> float:
        value = self.number(key, default)
        if not low <= value <= high:
            limits = f"between {low:g} and {high:g}" if math.isfinite(high) else f"at least {low:g}"
            self.fail(f"must be {limits}, got {value:g}", key)
        return value

    def flag(self, key: str, default: bool) -> bool:
        value = self.values.get(key, default)
        if not isinstance(value, bool):
            self.fail(f"expected true or false, got {shown(value)}", key)
        return value

    def choice(self, key: str, known: Sequence[str], default: str | None = None) -> str:
        value = self.get(key) if default is None else self.values.get(key, default)
        if not isinstance(value, str) or value not in known:
            self.fail(f"unknown {key} {shown(value)}; {nearest(str(value), known)}", key)
        return value

    def name(self, key: str, default: str) -> str:
        return str(self.checked(key, proper_name)) if key in self.values else default

    def vector(self, key: str, default: Vector | None = None) -> Vector:
        if default is not None and key not in self.values:
            return default
        x, y, z = self.numbers(key, 3)
        return (x, y, z)

    def numbers(self, key: str, count: int) -> list[float]:
        values = self.get(key)
        if not isinstance(values, list) or len(values) != count:
            self.fail(f"expected {count} numbers, got {shown(values)}", key)
        for i, value in enumerate(values):
            try:
                as_number(value)
            except ValueError as why:
                self.fail(str(why), key, i)
        return [float(value) for value in values]


def as_number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"expected a number, got {shown(value)}")
    if not abs(value) <= LARGEST:
        raise ValueError(f"must be finite and at most {LARGEST:g} in size, got {shown(value)}")
    return float(value)


def as_positive(value: object) -> float:
    number = as_number(value)
    if number < SMALLEST:
        raise ValueError(f"must be positive (at least {SMALLEST:g}), got {number:g}")
    return number


def direction(numbers: Sequence[float]) -> tuple[float, ...]:
    """The numbers scaled to length 1. Raises ValueError where all are 0."""
    size = math.hypot(*numbers)
    if size < SMALLEST:
        raise ValueError("has length 0, so that it gives no direction")
    # One that already has length 1, to rounding, is kept as written.
    return tuple(numbers) if abs(size - 1) < 1e-15 else tuple(x / size for x in numbers)


def _dotted(path: Path) -> str:
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{printable(part[:40])}" if text else printable(part[:40])
    return text
