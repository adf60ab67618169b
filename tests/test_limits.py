"""Breaking points: the search on limits that are known, on survival that is not monotone, and after a kill."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st
from impactbench.adapters.contestants import Contestant
from impactbench.reports.bisect import Range, Search
from impactbench.reports.cli import main
from impactbench.reports.limits import QUICK, families, hunt
from impactbench.reports.limits_view import text, view
from impactbench.reports.page import environment
from impactbench.reports.probe_store import ProbeStore, key_of
from impactbench.reports.sources import fingerprint

FAKES = Path(__file__).parent / "fakes" / "limits.py"
LIMIT = 1234.5
LOG, WHOLE, EVEN = Range(1.0, 1e8, "log"), Range(2, 200, "int"), Range(0.0, 3.0, "linear", "below")


def run(search: Search, survives: Callable[[float], bool | None]) -> Search:
    """Answer until nothing more is wanted, the last wanted first: the order must not matter."""
    for _ in range(100):
        wanted = search.wanted()
        if not wanted:
            return search
        for value in reversed(wanted):
            assert value not in search.answers
            search.put(value, survives(value))
    raise AssertionError("the search does not end")


@given(st.floats(1.0, 1e8, exclude_max=True))
@settings(max_examples=50, deadline=None)
def test_a_ratio_is_found_to_its_precision(limit: float) -> None:
    safe, lost = run(Search(LOG), lambda value: value <= limit).bracket()
    assert safe is not None
    assert lost is not None
    assert safe <= limit < lost <= safe * 1.05


@given(st.integers(2, 199))
@settings(max_examples=50, deadline=None)
def test_a_count_is_found_exactly(limit: int) -> None:
    assert run(Search(WHOLE), lambda value: value <= limit).bracket() == (limit, limit + 1)


@given(st.floats(0.0, 3.0, exclude_min=True))
@settings(max_examples=50, deadline=None)
def test_survival_lost_below_is_found_from_above(limit: float) -> None:
    safe, lost = run(Search(EVEN), lambda value: value >= limit).bracket()
    assert safe is not None
    assert lost is not None
    assert lost < limit <= safe <= lost + 0.05 * 3.0


def test_a_range_that_survives_or_fails_whole_says_so() -> None:
    assert run(Search(LOG), lambda _: True).status() == "at least"
    assert run(Search(LOG), lambda _: False).status() == "below"
    assert run(Search(LOG), lambda _: None).status() == "unknown"
    slow = run(Search(LOG), lambda value: True if value < 1e5 else None)
    assert (slow.status(), slow.bracket()) == ("at least", (10.0**4, None))


def test_survival_that_comes_back_is_told_and_the_first_loss_found() -> None:
    search = run(Search(LOG), lambda value: not 50 < value < 2e4)
    safe, lost = search.bracket()
    assert safe is not None
    assert lost is not None
    assert safe <= 50 < lost <= 1.05 * safe
    assert search.survivors_beyond() == [1e5, 1e6, 1e7, 1e8]
    assert run(Search(LOG), lambda value: value < 50).survivors_beyond() == []


def test_probes_are_bounded() -> None:
    search = run(Search(LOG, precision=1e-12, most=4), lambda value: value < LIMIT)
    assert len(search.answers) == 13
    assert search.status() == "found"


def fakes(*names: str) -> list[Contestant]:
    """As profiles of one engine they share children, which saves starting one for each."""
    return [Contestant("fakes", name, f"{FAKES}:{name}") for name in names]


@pytest.fixture(scope="module")
def part(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    names = ("Holds", "Gives", "GivesBetween", "AlwaysGives", "Dies", "Hangs", "Refuses", "Explodes")
    folder = tmp_path_factory.mktemp("limits")
    effort = replace(QUICK, sweep=5, limit=6.0)
    store = ProbeStore(folder / "probes.jsonl")
    return hunt(families(["heavy_on_light"]), fakes(*names), effort, 2, store)


def found(part: dict[str, Any], name: str) -> dict[str, Any]:
    return next(search for search in part["searches"] if search["contestant"] == f"fakes/{name}")


def test_a_fake_breaks_where_it_was_told_to(part: dict[str, Any]) -> None:
    gives = found(part, "Gives")
    assert gives["survives"] <= LIMIT < gives["fails"] <= 1.05 * gives["survives"]
    assert (gives["state"], gives["reason"], gives["monotone"]) == ("failed", "stands", True)
    assert abs(gives["time_to_failure"] - 2.5) < 1 / 240
    assert found(part, "Holds")["status"] == "at least"
    assert found(part, "AlwaysGives")["status"] == "below"


def test_an_engine_that_dies_or_diverges_has_not_survived(part: dict[str, Any]) -> None:
    for name, state in (("Dies", "crashed"), ("Explodes", "diverged")):
        search = found(part, name)
        assert search["survives"] <= LIMIT < search["fails"] <= 1.05 * search["survives"]
        assert search["state"] == state


def test_what_cannot_be_found_out_is_no_failure(part: dict[str, Any]) -> None:
    hangs = found(part, "Hangs")
    assert (hangs["status"], hangs["survives"], hangs["state"]) == ("at least", 1e6, "timed out")
    assert (found(part, "Refuses")["status"], found(part, "Refuses")["reason"]) == ("unknown", "no blocks here")


def test_tables_show_every_kind_of_end(part: dict[str, Any]) -> None:
    cells = {name: cell["text"] for name, cell in zip(part["contestants"], view(part)["rows"][0]["cells"], strict=True)}
    assert cells["fakes/Holds"] == ">= 1e+08"
    assert cells["fakes/AlwaysGives"] == "< 1"
    assert cells["fakes/Refuses"] == "-"
    assert cells["fakes/GivesBetween"].endswith("~")
    assert float(cells["fakes/Gives"]) <= LIMIT
    assert "Not monotone" in text(part)
    html = environment().get_template("limits.html").render(view=view(part))
    assert cells["fakes/Gives"] in html
    assert "GivesBetween" in html.partition("not monotone (1)")[2]
    json.dumps(part, allow_nan=False)


def test_settings_of_a_family_stand_beside_the_engines_profiles(part: dict[str, Any]) -> None:
    """As if the family named one fake's settings, and two others were the same engine's profiles."""
    names = {"fakes/AlwaysGives": "fakes/default", "fakes/Gives": "fakes/tuned", "fakes/Holds": "fakes/policy"}
    searches = [{**s, "contestant": names[s["contestant"]]} for s in part["searches"] if s["contestant"] in names]
    (row,) = view({**part, "contestants": ["fakes/default", "fakes/tuned"], "searches": searches})["mended"]
    assert (row["policy"], row["default"], row["point"]) == ("fakes/policy", "< 1", ">= 1e+08")
    assert float(row["tuned"]) <= LIMIT


def test_a_budget_that_is_spent_stops_the_bisection_and_says_so(tmp_path: Path) -> None:
    effort = replace(QUICK, budget=1e-9)
    store = ProbeStore(tmp_path / "probes.jsonl")
    (search,) = hunt(families(["heavy_on_light"]), fakes("Gives"), effort, 1, store)["searches"]
    assert (search["survives"], search["fails"], search["stopped"]) == (1e3, 1e4, True)


def test_a_killed_search_goes_on_where_it_was(tmp_path: Path) -> None:
    """Killed once five runs are stored; then every run but the one under way is done only once, to the same end."""
    runs, out = tmp_path / "runs", tmp_path / "out"
    command = [sys.executable, "-m", "impactbench.reports.cli", "limits", "heavy_on_light", "--jobs", "1"]
    command += ["--engine", f"{FAKES}:Logged", "--out", str(out)]
    environ = os.environ | {"RUNS": str(runs)}
    child = subprocess.Popen(command, env=environ, stdout=subprocess.DEVNULL)
    store = out / "limits.probes.jsonl"
    end = time.monotonic() + 30
    while not (store.exists() and store.read_text().count("\n") >= 5):
        assert time.monotonic() < end
        assert child.poll() is None
        time.sleep(0.02)
    child.send_signal(signal.SIGKILL)
    child.wait()
    with store.open("a") as stream:
        stream.write('{"key": "cut sho')  # as a kill in the middle of a line leaves it
    done = subprocess.run(command, env=environ, capture_output=True, text=True, check=True)
    counts = np.unique([float(line) for line in runs.read_text().split()], return_counts=True)[1]
    assert (counts > 1).sum() <= 1
    (search,) = json.loads((out / "limits.json").read_text())["searches"]
    assert search["survives"] <= LIMIT < search["fails"] <= 1.05 * search["survives"]
    assert len(search["probes"]) == len(counts)
    before = runs.read_text()
    again = CliRunner().invoke(main, command[3:])
    assert again.output == done.stdout
    assert runs.read_text() == before


def test_a_kept_run_counts_only_for_what_made_it(tmp_path: Path) -> None:
    mine = tmp_path / "mine.py"
    mine.write_text("# one\n")
    contestant = Contestant("Mine", "default", f"{mine}:Mine")
    first = key_of(contestant, "scene")
    assert first == key_of(contestant, "scene") != key_of(contestant, "other scene")
    mine.write_text("# two\n")
    fingerprint.cache_clear()
    assert key_of(contestant, "scene") != first


@pytest.mark.parametrize(("name", "words"), [("nonsense", "is no hard family"), ("equal_masses", "is no hard family")])
def test_a_family_without_a_knob_is_a_mistake_in_one_line(name: str, words: str, tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["limits", name, "--out", str(tmp_path)])
    assert result.exit_code == 2
    with pytest.raises(ValueError, match=words):
        families([name])
