"""What the page shows of the replays: data for its script, numbers for readers without one, what went wrong."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any
from urllib.parse import quote

import altair as alt
from impactbench.reports import charts
from impactbench.reports.page_data import percent, words
from impactbench.reports.replay_poster import poster, share

SHOWN = 4
"""Panels at first."""
FIGURES = ("energy_drift", "energy_gain", "momentum", "angular_momentum", "penetration")
EVENTS = ("first_contact", "first_violation", "largest_error")
TITLES = {
    "energy": "energy change",
    "momentum": "momentum error",
    "angular_momentum": "ang. mom. error",
    "penetration": "penetration",
    "position_error": "position error",
}


def view(
    document: dict[str, Any], style: charts.Style, featured: str | None, telling: Collection[str] = ()
) -> dict[str, Any] | None:
    """Values of the replay's template; None where nothing was recorded (results of an older version, or asked so).

    `featured` is the case of the first chart, `telling` are those like the one whose failure the verdict names.
    """
    found = document.get("replays") or {}
    cases = found.get("cases", [])
    if not cases:
        return None
    first = staged(cases, featured, telling)
    usual = {case["case"]: worst_of_engines(case) for case in cases}
    other = next((case for case in cases if case["case"] == featured and case is not first), None)
    picture = poster(first, usual[first["case"]], link, other)
    usual[first["case"]] = [panel["contestant"] for panel in picture["panels"]]
    names = list(dict.fromkeys(run["contestant"] for case in cases for run in case["runs"]))
    data = {
        **{key: found[key] for key in ("limit", "levels", "series", "cases")},
        "usual": usual,
        "styles": {name: {"colour": colour_of(name, style), "dash": dash_of(name)} for name in names},
        "poster": {"case": first["case"], "time": picture["time"], "focus": further(first, picture["runs"])},
    }
    return {
        "data": data,
        "spec": plots(names, style, found["limit"]),
        "limit": found["limit"],
        "notes": found["notes"],
        "rows": [row for case in cases for row in table(case)],
        "silent": [{"case": case["case"], **entry} for case in cases for entry in case["not_recorded"]],
        "jumps": jumps(cases),
        "poster": picture,
    }


def link(case: str, contestant: str, time: float) -> str:
    """Address of an instant of a replay inside its page."""
    return f"#scenario={quote(case, safe='')}&engine={quote(contestant, safe='')}&t={time:.4f}".rstrip("0").rstrip(".")


def colour_of(contestant: str, style: charts.Style) -> str:
    """The engine's colour in the charts."""
    return charts.PALETTE[style.engines.index(contestant.split("/")[0]) % len(charts.PALETTE)]


def dash_of(contestant: str) -> list[int]:
    """Vendors' defaults are dashed, as in the charts."""
    return [5, 3] if contestant.endswith("/default") else []


def badness(run: dict[str, Any]) -> float:
    """How far a run is from its truth, or from keeping energy where no truth is known; a diverged one is worst."""
    known = [run["summary"][name] or 0.0 for name in ("position_error", "energy_gain")]
    return max(known) if run["state"] == "ok" else 1e9


def worst_of_engines(case: dict[str, Any]) -> list[str]:
    """For each engine the run that went most wrong: the panels shown at first."""
    worst: dict[str, dict[str, Any]] = {}
    for run in case["runs"]:
        engine = run["contestant"].split("/")[0]
        if engine not in worst or badness(run) > badness(worst[engine]):
            worst[engine] = run
    return [run["contestant"] for run in worst.values()][:SHOWN]


def staged(cases: list[dict[str, Any]], featured: str | None, telling: Collection[str]) -> dict[str, Any]:
    """The case for the poster: the featured one if runs visibly part there, else a telling one, else where they part
    most.
    """

    def rank(case: dict[str, Any]) -> tuple[bool, bool, bool, float]:
        visible = bool(case["apart"] and case["apart"]["visible"])
        return visible, case["case"] == featured, case["case"] in telling, share(case)

    return max(cases, key=rank)


def further(case: dict[str, Any], names: Collection[str]) -> str:
    """Of these runs the one that goes more wrong; empty where there is none."""
    found = [run for run in case["runs"] if run["contestant"] in names]
    return str(max(found, key=badness)["contestant"]) if found else ""


def table(case: dict[str, Any]) -> Iterable[dict[str, Any]]:
    """One row a run: events as links into the replay, figures over the whole run."""
    for run in case["runs"]:
        found = [run["events"][name] for name in EVENTS]
        yield {
            "case": case["case"],
            "policy": run["contestant"],
            "step": run["step_text"],
            "events": [
                e and {"text": told(e), "link": link(case["case"], run["contestant"], e["time"])} for e in found
            ],
            "figures": [run["summary"][name] for name in FIGURES],
            "contacts": run["contact_count"],
        }


def told(event: dict[str, Any]) -> str:
    """An event in a few words."""
    size = "" if event["value"] is None else f": {words(event['what'])} {percent(event['value'])}"
    return f"{event['time']:.3f} s{size}"


def jumps(cases: list[dict[str, Any]]) -> dict[str, dict[str, list[dict[str, str]]]]:
    """Links into the replay for the failure cards, by case and policy: first violation and largest error."""
    found: dict[str, dict[str, list[dict[str, str]]]] = {}
    for case in cases:
        for run in case["runs"]:
            places = [(name, run["events"][name]) for name in EVENTS[1:] if run["events"][name]]
            found.setdefault(case["case"], {})[run["contestant"]] = [
                {"text": f"{words(name)}, {told(e)}", "link": link(case["case"], run["contestant"], e["time"])}
                for name, e in places
            ]
    return found


def plots(contestants: list[str], style: charts.Style, limit: float) -> dict[str, Any]:
    """Specification of the conservation plots; the page's script puts in the data of the run that is looked at."""
    colour = alt.Color(
        "run:N",
        scale=alt.Scale(domain=contestants, range=[colour_of(name, style) for name in contestants]),
        legend=None,
    )
    with charts.debug_mode(False):
        parts = [one_plot(name, title, colour, limit) for name, title in TITLES.items()]
        stack = alt.vconcat(*parts, config=charts.theme(), spacing=6).resolve_scale(color="shared")
        spec: dict[str, Any] = stack.to_dict(validate=False)
    spec["params"] = [{"name": "now", "value": 0}]
    return spec


def one_plot(name: str, title: str, colour: alt.Color, limit: float) -> alt.LayerChart | alt.FacetChart:
    """One measure over time, with its limit, the contacts and the replay's time."""
    time = alt.X("t:Q", scale=alt.Scale(nice=False), title="time [s]" if name == list(TITLES)[-1] else None)
    value = alt.Y("value:Q", title=title, axis=alt.Axis(format="~%", tickCount=4))
    focus, others = (
        alt.Chart(alt.NamedData(name + part)).encode(x=time, y=value, color=colour) for part in ("", " of others")
    )
    tips = [alt.Tooltip("run:N", title="run"), alt.Tooltip("t:Q", title="t [s]"), alt.Tooltip("value:Q", format=".3g")]
    layers: list[Any] = [
        others.mark_line(strokeWidth=1.2, opacity=0.45),
        focus.mark_line(strokeWidth=2.4).encode(tooltip=tips),
        alt.Chart(alt.NamedData("contacts")).mark_tick(color=charts.INK, opacity=0.7, height=8, thickness=1.2)
        .encode(x="t:Q", y=alt.value(76)),
        alt.Chart(alt.NamedData("once")).transform_calculate(now="now")
        .mark_rule(color=charts.INK, strokeWidth=1, aria=False).encode(x="now:Q"),
    ]  # fmt: skip
    if name == "energy":
        known = alt.Chart(alt.NamedData("expected"))
        layers.insert(0, known.mark_area(opacity=0.15, color=charts.INK).encode(x="t:Q", y="low:Q", y2="high:Q"))
        layers.insert(1, known.mark_line(color=charts.INK, strokeDash=[6, 4]).encode(x="t:Q", y="value:Q"))
    else:
        edge = alt.Chart(alt.NamedData("once")).mark_rule(color=charts.INK, strokeDash=[2, 3], aria=False)
        layers.insert(0, edge.encode(y=alt.datum(limit, type="quantitative")))
    return alt.layer(*layers, name=name, width=640, height=80)
