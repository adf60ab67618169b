"""Budgets that differ from the derived ones, as entries of a TOML file: an engine's known limits, a project's own.

    [[budget]]
    check = "rest-heights"      # a check's name or a glob
    engine = "pymunk/default"   # engine, contestant or glob; default: all
    case = "stacked_drop*"      # family, case or glob (brackets stand for themselves); default: all
    limit = 2e-3                # instead of the derived budget, in the check's own unit; or
    factor = 3.0                # times the derived budget; or
    off = true                  # this check says nothing here
    step = "1/240"              # limit holds at this step and grows as (h/step)^order; default: at every step
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

KEYS = ("check", "engine", "case", "limit", "factor", "off", "step", "order", "reason")
KNOWN_LIMITS = Path(__file__).with_name("known_limits.toml")


class BudgetError(ValueError):
    """A budget file cannot be used. One line: file, entry, what is wrong, what is possible instead."""


@dataclass(frozen=True)
class Override:
    """One entry: where it applies and what it allows. Exactly one of `limit`, `factor` and `off` is set."""

    check: str
    engine: str
    case: str
    reason: str
    limit: float | None = None
    factor: float | None = None
    off: bool = False
    step: float | None = None
    order: float = 0.0
    source: str = ""

    def matches(self, check: Check, contestant: str, case: str) -> bool:
        engine = contestant if "/" in self.engine else contestant.partition("/")[0]
        named = _glob(self.case, case) or _glob(self.case, case.partition("[")[0])
        return _glob(self.check, check.name) and _glob(self.engine, engine) and named

    def budget(self, check: Check, setting: Setting) -> float:
        if self.factor is not None:
            return self.factor * check.budget(setting)
        assert self.limit is not None
        return self.limit * ((setting.step / self.step) ** self.order if self.step else 1.0)


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
    texts = {key: _text(entry, key, where) for key in ("check", "engine", "case", "reason")}
    if not any(_glob(texts["check"], check.name) for check in CHECKS):
        names = ", ".join(check.name for check in CHECKS)
        raise BudgetError(f"{where}: no check is named {texts['check']!r}; known: {names}")
    if not texts["reason"]:
        raise BudgetError(f"{where}: a reason is missing")
    chosen = [key for key in ("limit", "factor", "off") if entry.get(key) not in (None, False)]
    if len(chosen) != 1:
        raise BudgetError(f"{where}: give one of limit, factor and off = true, not {', '.join(chosen) or 'none'}")
    numbers = {key: _number(entry, key, where) for key in ("limit", "factor", "order")}
    step = _step(entry, where)
    if numbers["order"] is not None and step is None:
        raise BudgetError(f"{where}: order needs the step at which limit holds")
    return Override(
        texts["check"], texts["engine"], texts["case"], texts["reason"],
        limit=numbers["limit"], factor=numbers["factor"], off=entry.get("off") is True,
        step=step, order=numbers["order"] or 0.0, source=where,
    )  # fmt: skip


def _text(entry: dict[str, Any], key: str, where: str) -> str:
    value = entry.get(key, "" if key == "reason" else "*")
    if not isinstance(value, str):
        raise BudgetError(f"{where}: {key} is a text, not {value!r}")
    return value


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


def _glob(pattern: str, name: str) -> bool:
    return re.fullmatch(re.escape(pattern).replace(r"\*", ".*").replace(r"\?", "."), name) is not None
