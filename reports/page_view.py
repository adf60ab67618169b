"""What the page says about one results document: verdict, scoreboard, one section a family, tables of the rest."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pandas as pd
from impactbench.reports import charts
from impactbench.reports.page_data import (
    amount,
    counted,
    finding,
    isolated,
    listing,
    number,
    order,
    percent,
    price,
    tidy_cells,
    tidy_rungs,
    time_to,
    words,
)

MAX_CHARTS = 24  # each costs some 60 kB (drawing and specification) and a quarter of a second
TARGET = 0.01
TARGETS = (0.1, 0.01, 0.001, 0.0001)


class View:
    """What the page says about one document."""

    def __init__(self, document: dict[str, Any]) -> None:
        self.document = document
        self.cases = {case["name"]: case for case in document["cases"]}
        self.cells = tidy_cells(document)
        self.units = {row["measure"]: row.get("unit", "1") for row in document["rows"]}
        self.measures = list(dict.fromkeys(row["measure"] for row in document["rows"]))
        self.rungs = self.with_axes(tidy_rungs(self.cells, document["rows"]))
        self.policies = list(dict.fromkeys(self.cells["policy"]))
        engines = list(dict.fromkeys(policy.split("/")[0] for policy in self.policies))
        self.style = charts.Style(engines, self.policies)
        self.lines = dict(iter(self.rungs.groupby(["case", "policy"], sort=False)))
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
        return rungs

    def of(self, case: str) -> dict[str, pd.DataFrame]:
        """Rungs of a case by policy."""
        return {policy: self.lines[case, policy] for policy in self.policies if (case, policy) in self.lines}

    def content(self) -> dict[str, Any]:
        """Everything the template shows."""
        families: dict[str, list[str]] = {}
        for name, case in self.cases.items():
            families.setdefault(case["family"], []).append(name)
        featured = self.featured()
        sections = [self.section(i, family, names, featured) for i, (family, names) in enumerate(families.items())]
        if len(families) > MAX_CHARTS:
            self.thinned.append(f"Charts are drawn for the first {MAX_CHARTS} families; the others have tables only.")
        if len(self.cases) > len(families):
            self.thinned.append(
                "Each family charts one case; the others are in the scoreboard and the family's tables."
            )
        return {
            "provenance": self.document["provenance"],
            "verdict": self.verdict(),
            "first": next((s for s in sections if featured and s["case"]["name"] == featured), None),
            "sections": sections,
            "scoreboard": self.scoreboard(),
            "policies": self.policies,
            "targets": TARGETS,
            "statuses": self.statuses(),
            "settings": self.settings(),
            "versions": self.cells.drop_duplicates("contestant")[["contestant", "version"]]
            .fillna("")
            .to_dict("records"),
        }

    def featured(self) -> str | None:
        """A stacked drop, else the first case; among the timed ones if anything was timed."""
        drawn = self.rungs[self.rungs["error"].notna() & self.rungs["cost"].notna() & (self.rungs["state"] == "ok")]
        names = list(dict.fromkeys((drawn[drawn["timed"]] if drawn["timed"].any() else drawn)["case"]))
        stacked = [n for n in names if "stacked_drop" in (n + self.cases[n]["family"])]
        return next(iter([*stacked, *map(str, names)]), None)

    def verdict(self) -> list[str]:
        """Sentences with numbers: what ran, what did not, what was worst."""
        return [self.coverage(), *self.worst()]

    def coverage(self) -> str:
        """What was compared on what, and how many cells gave no result."""
        states = self.cells["state"].value_counts()
        other = ", ".join(f"{n} {state}" for state, n in states.items() if state != "ok")
        steps = self.cells[self.cells["step"] > 0].sort_values("step", ascending=False)["step_text"].drop_duplicates()
        ladder = f" at {len(steps)} step sizes ({steps.iloc[0]} to {steps.iloc[-1]} s)" if len(steps) else ""
        who, cases = counted(self.cells["contestant"].nunique(), "contestant"), counted(len(self.cases), "case")
        ran = f"{states.get('ok', 0)} of {counted(len(self.cells), 'cell')} ran"
        return f"{who} compared on {cases}{ladder}: {ran}" + (f"; {other}." if other else ".")

    def worst(self) -> list[str]:
        """The largest energy gain and loss, and the largest headline error at a policy's own finest step."""
        ran = self.rungs[self.rungs["state"] == "ok"]
        found = []
        for measure, name, sign in (("energy_gain", "energy gain", 1), ("energy_drift", "energy drift", -1)):
            size = sign * ran[measure] if measure in ran else pd.Series(dtype=float)
            if size.notna().any() and size.max() > 0:
                what = f"shows an {name} of {percent(sign * size.max())}"
                found.append(finding(ran.loc[size.idxmax()], what, size.max() > TARGET))
        finest = ran.sort_values("step").drop_duplicates(["case", "policy"])
        unit = finest["case"].map(lambda name: self.units.get(self.cases[name]["headline"], "1"))
        finest = finest[(unit == "1") & finest["error"].notna()]
        if len(finest):
            rung = finest.loc[finest["error"].idxmax()]
            name = words(self.cases[rung["case"]]["headline"])
            what = f"has a {name} of {percent(rung['error'])} at its finest step"
            found.append(finding(rung, what, rung["error"] > TARGET))
        return found

    def section(self, index: int, family: str, names: list[str], featured: str | None) -> dict[str, Any]:
        """One family: the chart of one of its cases and the tables of all."""
        drawable = self.rungs[self.rungs["error"].notna() & self.rungs["cost"].notna() & (self.rungs["state"] == "ok")]
        charted = [name for name in names if (drawable["case"] == name).any()]
        timed = [name for name in charted if drawable.loc[drawable["case"] == name, "timed"].any()]
        name = featured if featured in names else (timed or charted or names)[0]
        case = self.cases[name]
        points = drawable[drawable["case"] == name]
        chart = self.chart(f"chart-{index}", case, points) if len(points) and index < MAX_CHARTS else None
        return {
            "id": f"family-{index}",
            "family": family,
            "case": case,
            "names": names,
            "unit": self.units.get(case["headline"], "1"),
            "chart": chart,
            "reach": self.reach(name),
            "phases": len({cell["phase"] for cell in self.document["cells"] if cell["case"] == name}),
            "orders": {policy: order(line) for policy, line in self.of(name).items()},
            "measures": self.measure_table(name),
            "data": points.sort_values(["policy", "step"]).to_dict("records"),
            "others": self.finest_errors(names),
            "laws": [row for row in self.document.get("law_difference", []) if row["case"] in names and row["value"]],
            "same_laws": [r for r in self.document.get("law_difference", []) if r["case"] in names and not r["value"]],
            "failed": self.failures(name).to_dict("records"),
        }

    def chart(self, name: str, case: dict[str, Any], points: pd.DataFrame) -> dict[str, Any]:
        """Specification and static drawing of one case."""
        timed = bool(points["timed"].all())
        unit = self.units.get(case["headline"], "1")
        over = f"{words(case['headline'])}" + (" (1 = the scene's own scale)" if unit == "1" else f" [{unit}]")
        cost = "wall time per simulated second [ms]" if timed else "steps per simulated second (not timed)"
        columns = ["policy", "engine", "profile", "step", "step_text", "error", "cost", "low", "high", "timed"]
        titled = (over, cost)
        with charts.debug_mode(False):  # no validation of every part against the schema: it doubles the time
            plot = charts.work_precision(points[columns], self.failures(case["name"]), self.style, titled)
            plot = plot.properties(description=f"{cost} against {over}; the table below holds the same data")
            spec = plot.to_dict(validate=False)
        return {"id": name, "spec": spec, "svg": charts.svg_of(spec, name), "timed": timed, "over": over, "cost": cost}

    def failures(self, case: str) -> pd.DataFrame:
        """Rungs of a case without a result, one line for each policy, state and reason."""
        rungs = self.rungs[self.rungs["case"] == case]
        silent = (rungs["state"] == "ok") & rungs["error"].isna()  # ran, but the headline is not defined here
        rungs = rungs.assign(state=rungs["state"].mask(silent, "no figure"))
        bad = rungs[rungs["state"] != "ok"]
        grouped = bad.groupby(["policy", "engine", "state", "reason"], sort=False)["step_text"]
        return grouped.agg(lambda texts: listing(text or "every step" for text in texts)).reset_index(name="steps")

    def reach(self, case: str) -> str:
        """Which policies stay below the target, at what cost, and which do not get there."""
        unit = self.units.get(self.cases[case]["headline"], "1")
        lines = self.of(case)
        found = {policy: time_to(line, TARGET) for policy, line in lines.items()}
        reached = sorted(
            ((float(r["cost"]), p, r) for p, r in found.items() if r is not None), key=lambda item: item[:2]
        )
        missed = [p for p, r in found.items() if r is None and (lines[p]["state"] == "ok").any()]
        silent = [p for p in lines if not (lines[p]["state"] == "ok").any()]
        best = [f"{isolated(p)} {price(rung)}" for _, p, rung in reached]
        goal = "1 % error" if unit == "1" else f"an error of {TARGET} {unit}"
        timed = any(line["timed"].any() for line in lines.values())
        scale = "ms per simulated second" if timed else "coarsest step that does"
        text = f"To stay below {goal}, {scale}: {'; '.join(best)}." if best else f"No policy stays below {goal}."
        if missed and best:
            text += f" {listing(missed, 20)} {'does' if len(missed) == 1 else 'do'} not get there."
        return text + (f" No result: {listing(silent, 20)}." if silent else "")

    def measure_table(self, case: str) -> dict[str, Any]:
        """Every measure by policy, at the finest step that all stepping policies with a result share."""
        ran = {p: line[line["state"] == "ok"] for p, line in self.of(case).items()}
        ran = {p: line for p, line in ran.items() if len(line)}
        ladders = [set(line["step"]) for line in ran.values() if (line["step"] > 0).any()]
        common = min(set.intersection(*ladders), default=None) if ladders else None
        chosen = {}
        for policy, line in ran.items():
            same = line[line["step"] == common]
            chosen[policy] = (same if len(same) else line.sort_values("step")).iloc[0]
        rows = [
            {
                "name": measure,
                "unit": self.units[measure],
                "values": [rung.get(measure, np.nan) for rung in chosen.values()],
            }
            for measure in self.measures
        ]
        rows = [row for row in rows if not all(np.isnan(value) for value in row["values"])]
        steps = [rung["step_text"] or "none" for rung in chosen.values()]
        return {"policies": list(chosen), "steps": steps, "rows": rows}

    def finest_errors(self, names: list[str]) -> list[dict[str, Any]]:
        """Headline error of every case of a family at each policy's finest step, or the state it ended in."""
        return [
            {"case": self.cases[name], "cells": [self.finest(name, policy) for policy in self.policies]}
            for name in names
        ]

    def finest(self, case: str, policy: str) -> str:
        """Headline error at the finest step, or why there is none."""
        line = self.lines.get((case, policy))
        if line is None:
            return "–"
        rung = line.sort_values("step").iloc[0]
        if rung["state"] != "ok":
            return str(rung["state"])
        return amount(rung["error"], self.units.get(self.cases[case]["headline"], "1")) if rung["error"] >= 0 else "–"

    def scoreboard(self) -> list[dict[str, Any]]:
        """Cases against policies; cells hold their ladder, fine to coarse, so that a script can change the target."""
        rows = []
        for name, case in self.cases.items():
            cells = [self.score(name, policy) for policy in self.policies]
            bad = sum(cell["kind"] != "met" for cell in cells)
            rows.append({"case": case, "cells": cells, "bad": bad})
        return sorted(rows, key=lambda row: -int(row["bad"]))

    def score(self, case: str, policy: str) -> dict[str, Any]:
        """One cell of the scoreboard: cheapest rung below the target, or how close it came, or its state."""
        line = self.lines.get((case, policy))
        if line is None:
            return {"kind": "none", "text": "–", "ladder": None}
        if not (line["state"] == "ok").any():
            return {"kind": "state", "text": str(line.iloc[0]["state"]), "ladder": None}
        ladder = []
        for _, rung in line.sort_values("step").iterrows():
            usable = rung["state"] == "ok" and not np.isnan(rung["error"])
            cost = None if np.isnan(rung["cost"]) else float(f"{rung['cost']:.3g}")
            text = f"{number(rung['cost'])} ms" if rung["timed"] else rung["step_text"] or "any step"
            ladder.append([float(f"{rung['error']:.3g}") if usable else None, cost, text])
        rung = time_to(line, TARGET)
        if rung is None:
            return {"kind": "missed", "text": "✕ not reached", "ladder": ladder}
        text = f"{number(rung['cost'])} ms" if rung["timed"] else rung["step_text"] or "any step"
        return {"kind": "met", "text": f"✓ {text}", "ladder": ladder}

    def statuses(self) -> list[dict[str, Any]]:
        """All cells without a result, grouped by who, what and why."""
        bad = self.cells[self.cells["state"] != "ok"]
        rows = []
        for (policy, state, reason), group in bad.groupby(["policy", "state", "reason"], sort=False):
            steps = [text for text in group.sort_values("step")["step_text"] if text]
            row = {"policy": policy, "state": state, "reason": reason, "count": len(group)}
            rows.append({**row, "cases": listing(group["case"], 8), "steps": listing(steps, 8)})
        return sorted(rows, key=lambda row: (row["state"], -row["count"]))

    def settings(self) -> list[dict[str, Any]]:
        """What each policy was told: every setting with the values it took."""
        told: dict[tuple[str, str], dict[str, None]] = {}
        for policy, settings in zip(self.cells["policy"], self.cells["settings"], strict=True):
            for key, value in settings.items() if isinstance(settings, dict) else ():
                text = value if isinstance(value, str) else json.dumps(value)
                told.setdefault((policy, str(key)), {})[text] = None
        return [{"policy": p, "key": k, "count": len(v), "values": listing(v, 6)} for (p, k), v in sorted(told.items())]

    def embeddable(self) -> list[tuple[list[str], Any]]:
        """What to embed as data, from everything to nothing, each with the note that says what was left out."""
        columns = ["case", "policy", "step_text", "state", "error", "cost"]
        brief = self.rungs[columns].astype(object).where(self.rungs[columns].notna(), None)
        whole = "The raw rows are too large for this page and are in the results file beside it"
        return [
            ([], {key: part for key, part in self.document.items() if key != "replays"}),  # embedded by itself
            ([f"{whole}; embedded here is the worst phase of every rung."], brief.to_dict("records")),
            ([f"{whole}; no data is embedded here."], None),
        ]
