"""What the page says about one results document: verdict, scoreboard, one section a family, tables of the rest."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
from impactbench.reports import (
    charts,
    charts_plain,
    page_failures,
    page_scores,
    page_timing,
    page_verdict,
    replay_view,
)
from impactbench.reports.page_data import TARGET, TARGETS, Line, Rung, percent, tidy_cells, tidy_rungs
from impactbench.reports.page_family import MAX_CHARTS, section


class View:
    """What the page says about one document."""

    def __init__(self, document: dict[str, Any], most_charts: int = MAX_CHARTS) -> None:
        self.document = document
        self.most_charts = most_charts  # families that are charted
        self.sparse = most_charts < MAX_CHARTS // 4  # no tables of rungs but behind charts
        self.cases = {case["name"]: case for case in document["cases"]}
        self.cells = tidy_cells(document)
        self.units = {row["measure"]: row.get("unit", "1") for row in document["rows"]}
        self.measures = list(dict.fromkeys(row["measure"] for row in document["rows"]))
        self.rungs = self.with_axes(tidy_rungs(self.cells, document["rows"]))
        self.policies = list(dict.fromkeys(self.cells["policy"]))
        engines = dict.fromkeys(policy.split("/")[0] for policy in self.policies)
        self.style = charts.Style(tuple(engines), tuple(self.policies))
        # Plain rows: what is asked of one case or one line at a time costs a hundred times as much of a frame.
        rows = self.rungs.to_dict("records")
        self.by_case: dict[str, list[Rung]] = {name: [] for name in self.cases}
        self.lines: dict[tuple[str, str], Line] = {}
        for rung in rows:
            self.by_case[rung["case"]].append(rung)
        for rung in sorted(rows, key=lambda rung: float(rung["step"])):
            self.lines.setdefault((rung["case"], rung["policy"]), []).append(rung)
        self.featured = self.stacked_or_first()
        self.sources: dict[str, str] = document["provenance"].get("engines", {})
        self.thinned: list[str] = []

    def with_axes(self, rungs: pd.DataFrame) -> pd.DataFrame:
        """Add the columns charts are drawn from: error (the case's headline) and cost (time, else steps a second)."""
        rungs = rungs.reset_index(drop=True)
        for name in ["wall_time", "wall_time_low", "wall_time_high", *{c["headline"] for c in self.cases.values()}]:
            if name not in rungs:
                rungs[name] = np.nan
        headline = rungs["case"].map(lambda name: self.cases[name]["headline"])
        picked = [rungs.at[i, measure] for i, measure in headline.items()]
        rungs["error"] = np.abs(np.array(picked, dtype=float))
        rungs["timed"] = rungs.groupby("case")["wall_time"].transform("count") > 0
        steps = 1 / rungs["step"].where(rungs["step"] > 0)
        rungs["cost"] = (1e3 * rungs["wall_time"]).where(rungs["timed"], steps)
        rungs["low"], rungs["high"] = 1e3 * rungs["wall_time_low"], 1e3 * rungs["wall_time_high"]
        rungs["engine"] = rungs["policy"].str.split("/").str[0]
        rungs["profile"] = np.where(rungs["policy"].str.contains("/default"), "default", "other")
        # Plain objects: small slices of columns of the string type cost four times as much.
        rungs = rungs.astype(dict.fromkeys(rungs.select_dtypes("str").columns, object))
        return rungs

    def of(self, case: str) -> dict[str, Line]:
        """Rungs of a case by policy."""
        return {policy: self.lines[case, policy] for policy in self.policies if (case, policy) in self.lines}

    def drawable(self) -> pd.DataFrame:
        """Rungs that a chart can show: with an error and a cost."""
        return self.rungs[self.rungs["error"].notna() & self.rungs["cost"].notna() & (self.rungs["state"] == "ok")]

    def points(self, case: str) -> list[Rung]:
        """Rungs of a case that a chart can show."""
        found = self.by_case.get(case, [])
        return [r for r in found if r["state"] == "ok" and not (math.isnan(r["error"]) or math.isnan(r["cost"]))]

    def finest_rungs(self) -> pd.DataFrame:
        """The finest rung of every case and policy, where it has a result."""
        finest = self.rungs.sort_values("step", kind="stable").drop_duplicates(["case", "policy"]).sort_index()
        return finest[finest["state"] == "ok"]

    def unit_of(self, case: str) -> str:
        """Unit of a case's headline measure."""
        return str(self.units.get(self.cases[case]["headline"], "1"))

    def goal(self, case: dict[str, Any], target: float = TARGET) -> str:
        """The target in words."""
        unit = self.unit_of(case["name"])
        return f"{percent(target)} error" if unit == "1" else f"an error of {target:g} {unit}"

    def content(self) -> dict[str, Any]:
        """Everything the template shows."""
        families: dict[str, list[str]] = {}
        for name, case in self.cases.items():
            families.setdefault(case["family"], []).append(name)
        sections = [section(self, i, family, names) for i, (family, names) in enumerate(families.items())]
        if len(families) > self.most_charts:
            text = f"Charts are drawn for the first {self.most_charts} families; the others have tables only."
            self.thinned.append(text)
            if self.sparse:
                self.thinned.append("Rungs are listed behind those charts only; the others are in the results file.")
        if len(self.cases) > len(families):
            self.thinned.append(
                "Each family charts one case; the others are in the scoreboard and the family's tables."
            )
        scores = page_scores.scoreboard(self)
        return {
            "provenance": self.document["provenance"],
            "coverage": page_verdict.coverage(self),
            "verdict": page_verdict.verdict(self),
            "first": next((s for s in sections if s["case"]["name"] == self.featured), None),
            "sections": sections,
            "cards": page_failures.cards(self),
            "replay": self.replay(),
            "scoreboard": scores,
            "ladders": [[cell["ladder"] for cell in row["cells"]] for row in scores],
            "policies": self.policies,
            "engines": self.style.engines,
            "blank": charts_plain.blank(self.style),
            "targets": TARGETS,
            "target": TARGET,
            "timing": page_timing.timing(self),
            "savings": page_timing.savings(self),
            "statuses": page_scores.statuses(self),
            "settings": page_scores.settings(self),
            "versions": self.cells.drop_duplicates("contestant")[["contestant", "version"]]
            .fillna("")
            .to_dict("records"),
        }

    def replay(self) -> dict[str, Any] | None:
        """What the replay's part of the page shows, if anything was recorded."""
        worst = page_verdict.worst(self)
        family = self.cases[worst[0]["case"]]["family"] if worst else None
        alike = [name for name, case in self.cases.items() if case["family"] == family]
        found = replay_view.view(self.document, self.style, self.featured, alike)
        self.thinned += found["notes"] if found else []
        return found

    def stacked_or_first(self) -> str | None:
        """A stacked drop, else the first case; among the timed ones if anything was timed."""
        drawn = self.drawable()
        names = list(dict.fromkeys((drawn[drawn["timed"]] if drawn["timed"].any() else drawn)["case"]))
        stacked = [n for n in names if "stacked_drop" in (n + self.cases[n]["family"])]
        return next(iter([*stacked, *map(str, names)]), None)

    def embeddable(self) -> list[tuple[list[str], Any]]:
        """What to embed as data, from everything to nothing, each with the note that says what was left out."""
        whole = "The raw rows are too large for this page and are in the results file beside it"
        return [
            ([], {key: part for key, part in self.document.items() if key != "replays"}),  # embedded by itself
            ([f"{whole}; embedded here is the worst phase of every rung, to six digits."], self.brief()),
            ([f"{whole}; no data is embedded here."], None),
        ]

    def brief(self) -> dict[str, Any]:
        """Every rung by case and policy: step, state, headline error, cost as in the charts; None where unknown."""
        found: dict[str, Any] = {"columns": ["step", "state", "error", "cost"]}
        for (case, policy), line in self.lines.items():
            rungs = [[r["step_text"], r["state"], *(_six(r[name]) for name in ("error", "cost"))] for r in line]
            found.setdefault("rungs", {}).setdefault(case, {})[policy] = rungs
        return found


def _six(value: float) -> float | None:
    return None if math.isnan(value) else float(f"{value:.6g}")
