"""Budgets that differ from the derived ones, as entries of a TOML file: an engine's known limits, a project's own.

    [[budget]]
    check = "rest-heights"      # a check's name or a glob, or a list of such
    engine = "pymunk/default"   # engine, contestant or glob, or a list; default: all
    case = "stacked_drop*"      # family, case or glob (brackets stand for themselves), or a list; default: all
    limit = 2e-3                # instead of the derived budget, in the check's own unit; or
    at_least = 2e-3             # the derived budget, but never less than this; or
    factor = 3.0                # times the derived budget; or
    off = true                  # this check says nothing here
    step = "1/240"              # limit or at_least hold here and grow as (h/step)^order; default: at every step
    order = 1
    reason = "slop 1e-3 is left alone"

The last entry that matches wins. A file's entries come after the known limits of the engines' tuned profiles
(known_limits.toml), which `known_limits = false` at the top of the file leaves out.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from impactbench.reports.budget_formulas import Setting
from impactbench.reports.budgets import CHECKS, Check
from impactbench.reports.cell import step_seconds

KEYS = ("check", "engine", "case", "limit", "at_least", "factor", "off", "step", "order", "reason")
KNOWN_LIMITS = Path(__file__).with_name("known_limits.toml")


class BudgetError(ValueError):
    """A budget file cannot be used. One line: file, entry, what is wrong, what is possible instead."""


@dataclass(frozen=True)
class Override:
    """One entry: where it applies and what it allows. Exactly one of `limit`, `at_least`, `factor` and `off` is set."""

    check: tuple[str, ...]
    engine: tuple[str, ...]
    case: tuple[str, ...]
    reason: str
    limit: float | None = None
    at_least: float | None = None
    factor: float | None = None
    off: bool = False
    step: float | None = None
    order: float = 0.0
    source: str = ""

    def matches(self, check: Check, contestant: str, case: str) -> bool:
        return (
            _any(self.check, check.name)
            and _any(self.engine, contestant, contestant.partition("/")[0])
            and _any(self.case, case, case.partition("[")[0])
        )

    def budget(self, check: Check, setting: Setting) -> float:
        if self.factor is not None:
            return self.factor * check.budget(setting)
        scale = (setting.step / self.step) ** self.order if self.step else 1.0
        if self.at_least is not None:
            return max(self.at_least * scale, check.budget(setting))
        assert self.limit is not None
        return self.limit * scale


Overrides = Sequence[Override]


def overriding(overrides: Overrides, check: Check, contestant: str, case: str) -> Override | None:
    """The last entry that matches, if any."""
    return next((entry for entry in reversed(overrides) if entry.matches(check, contestant, case)), None)


def known_limits() -> tuple[Override, ...]:
    """What the shipped adapters are known not to reach, each with its reason."""
    return _entries(_parsed(KNOWN_LIMITS), KNOWN_LIMITS.name)


def read_budgets(path: Path | None) -> tuple[Override, ...]:
    """The known limits and then the file's entries. Raises BudgetError."""
    if path is None:
        return known_limits()
    document = _parsed(path)
    unknown = [key for key in document if key not in ("budget", "known_limits")]
    if unknown:
        raise BudgetError(f"{path}: unknown key {unknown[0]!r}; a budget file holds [[budget]] and known_limits")
    keep = document.get("known_limits", True)
    if not isinstance(keep, bool):
        raise BudgetError(f"{path}: known_limits is true or false, not {keep!r}")
    return (*(known_limits() if keep else ()), *_entries(document, path.name))


def _parsed(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise BudgetError(f"cannot read {path}: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise BudgetError(f"{path} is not TOML: {error}") from None


def _entries(document: dict[str, Any], name: str) -> tuple[Override, ...]:
    entries = document.get("budget", [])
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise BudgetError(f"{name}: budgets are written as [[budget]] tables")
    return tuple(_entry(entry, f"{name}, budget {number}") for number, entry in enumerate(entries, 1))


def _entry(entry: dict[str, Any], where: str) -> Override:
    unknown = [key for key in entry if key not in KEYS]
    if unknown:
        raise BudgetError(f"{where}: unknown key {unknown[0]!r}; known: {', '.join(KEYS)}")
    places = {key: _texts(entry, key, where) for key in ("check", "engine", "case")}
    for text in places["check"]:
        if not any(_any((text,), check.name) for check in CHECKS):
            names = ", ".join(check.name for check in CHECKS)
            raise BudgetError(f"{where}: no check is named {text!r}; known: {names}")
    reason = entry.get("reason")
    if not isinstance(reason, str) or not reason.strip():
        raise BudgetError(f"{where}: a reason is missing")
    chosen = [key for key in ("limit", "at_least", "factor", "off") if entry.get(key) not in (None, False)]
    if len(chosen) != 1:
        raise BudgetError(
            f"{where}: give one of limit, at_least, factor and off = true, not {', '.join(chosen) or 'none'}"
        )
    numbers = {key: _number(entry, key, where) for key in ("limit", "at_least", "factor", "order")}
    step = _step(entry, where)
    if numbers["order"] is not None and step is None:
        raise BudgetError(f"{where}: order needs the step at which the number holds")
    return Override(
        **places,
        reason=" ".join(reason.split()),
        limit=numbers["limit"],
        at_least=numbers["at_least"],
        factor=numbers["factor"],
        off=entry.get("off") is True,
        step=step,
        order=numbers["order"] or 0.0,
        source=where,
    )


def _texts(entry: dict[str, Any], key: str, where: str) -> tuple[str, ...]:
    value = entry.get(key, "*")
    values = value if isinstance(value, list) else [value]
    if not values or not all(isinstance(text, str) and text for text in values):
        raise BudgetError(f"{where}: {key} is a text or a list of texts, not {value!r}")
    return tuple(values)


def _number(entry: dict[str, Any], key: str, where: str) -> float | None:
    value = entry.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not (math.isfinite(value) and value >= 0):
        raise BudgetError(f"{where}: {key} is a number of at least 0, not {value!r}")
    return float(value)


def _step(entry: dict[str, Any], where: str) -> float | None:
    if "step" not in entry:
        return None
    try:
        return step_seconds(str(entry["step"]))
    except ValueError as error:
        raise BudgetError(f"{where}: {error}") from None


def _any(patterns: tuple[str, ...], *names: str) -> bool:
    """Whether one of the patterns, with * and ?, is one of the names."""
    matchers = [re.escape(pattern).replace(r"\*", ".*").replace(r"\?", ".") for pattern in patterns]
    return any(re.fullmatch(matcher, name) for matcher in matchers for name in names)
