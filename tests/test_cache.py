"""The cache of outcomes: what an interrupted, repeated or damaged sweep runs again, and what its rows are."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from impactbench.adapters.contestants import CONTESTANTS, Contestant
from impactbench.adapters.contestants import select as select_contestants
from impactbench.reports import compare as comparison
from impactbench.reports import sources
from impactbench.reports.cache import FAILED, Cache
from impactbench.scenarios.catalogue import select

COMMAND = str(Path(sys.executable).parent / "impactbench")
WORDS = ["compare", "static_wall", "--engine", "pymunk", "--timing", "none"]


def kept(folder: Path) -> list[Path]:
    return [path for path in folder.glob(".cache/??/*") if not path.suffix]


def test_a_killed_sweep_goes_on_where_it_was(tmp_path: Path) -> None:
    """SIGKILL, which nothing can catch, once at least 8 outcomes are stored; the other run is left alone."""
    sweep = subprocess.Popen([COMMAND, *WORDS, "--jobs", "1", "--out", str(tmp_path)], stdout=subprocess.DEVNULL)
    try:
        deadline = time.monotonic() + 60
        while len(kept(tmp_path)) < 8 and sweep.poll() is None and time.monotonic() < deadline:
            time.sleep(0.002)
    finally:
        sweep.send_signal(signal.SIGKILL)
    assert sweep.wait() == -signal.SIGKILL, "it was over before it could be killed"
    before = len(kept(tmp_path))
    assert before >= 8
    assert not (tmp_path / "results.json").exists()
    subprocess.run([COMMAND, *WORDS, "--out", str(tmp_path)], check=True, stdout=subprocess.DEVNULL, timeout=120)
    again = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    plan = comparison.Plan(select(["static_wall"]), select_contestants(["pymunk"]), jobs=2, timing="none")
    undisturbed = json.loads(json.dumps(comparison.compare(plan, "test")))
    assert again["rows"] == undisturbed["rows"]
    assert again["cells"] == undisturbed["cells"]
    assert before <= again["provenance"]["cached_cells"] < len(again["cells"])


def plan_of(contestants: tuple[Contestant, ...], cases: tuple[str, ...] = ("free_flight[dimension=1]",)) -> Any:
    return comparison.Plan(select(cases), contestants, ("1/30", "1/60"), jobs=2, timing="none")


def run(plan: Any, folder: Path, again: tuple[str, ...] = ()) -> tuple[dict[str, Any], Cache]:
    cache = Cache(folder, again)
    return comparison.compare(plan, "test", cache=cache), cache


def test_the_cache_gives_back_every_bit_and_survives_damage(tmp_path: Path) -> None:
    plan = plan_of(select_contestants(["pymunk"]), ("static_wall", "bouncing_ball[bounciness=0.8]"))
    fresh = comparison.compare(plan, "test")
    run(plan, tmp_path)
    files = sorted(path for path in tmp_path.glob("??/*"))
    assert len(files) == len(fresh["cells"])
    whole = files[1].read_bytes()
    files[0].write_bytes(b"")
    files[1].write_bytes(whole[: len(whole) // 2])
    third = files[2].read_bytes()
    files[2].write_bytes(third.replace(b'"reason":"', b'"reason":"?', 1))  # JSON still, but wrong
    again, cache = run(plan, tmp_path)
    assert (again["rows"], again["cells"]) == (fresh["rows"], fresh["cells"])
    assert cache.served == len(files) - 3
    assert sum("3 files of the cache were damaged" in note for note in again["provenance"]["notes"]) == 1
    assert files[1].read_bytes() == whole


FLAKY = """
import os, signal
from pathlib import Path
from impactbench.scenarios.trajectory import State
import numpy as np

class Flaky:
    settings = {}
    def __init__(self, scene, law, profile, model, step):
        self.step = step
        with Path(MARK).open("a") as log:
            log.write(f"{step:.4f}\\n")
    def advance(self, steps):
        if self.step < 1 / 40 and len(Path(MARK).read_text().splitlines()) < 3:
            os.kill(os.getpid(), signal.SIGSEGV)
    def read(self):
        return State(np.zeros((1, 3)), np.zeros((1, 3)))
    def close(self): ...
"""


def test_rerun_failed_runs_what_failed_and_nothing_else(tmp_path: Path) -> None:
    """The engine crashes at 1/60 in its first sweep only and writes down every world it builds."""
    mark = tmp_path / "mark"
    (tmp_path / "flaky.py").write_text(f"MARK = {str(mark)!r}\n{FLAKY}")
    plan = plan_of(select_contestants([f"{tmp_path / 'flaky.py'}:Flaky"]))

    def states(again: tuple[str, ...]) -> tuple[list[str], list[str]]:
        document, cache = run(plan, tmp_path / "cache", again)
        return [cell["state"] for cell in document["cells"]], cache.notes(len(document["cells"]))

    assert states(())[0] == ["ok", "crashed"]
    found, notes = states(())
    assert found == ["ok", "crashed"]
    assert "1 of them had failed" in notes[0]
    assert sorted(mark.read_text().split()) == ["0.0167", "0.0333"]
    assert states(FAILED)[0] == ["ok", "ok"]
    assert sorted(mark.read_text().split()) == ["0.0167", "0.0167", "0.0333"]


def test_whatever_a_figure_depends_on_misses(tmp_path: Path) -> None:
    """Each change of what a cell is leads to a file of its own."""
    (case,) = select(["oblique_wall"])[:1]
    (contestant,) = select_contestants(["pymunk/tuned"])
    cell = comparison.cell_of(case, "nc", contestant.name, "minimal", "1/60", 0.0)
    body = replace(case.scene.bodies[0], velocity=(1.0, 0.0, 1e-300))
    moved = replace(case.scene, bodies=(body, *case.scene.bodies[1:]))
    cells = [
        cell,
        *(replace(cell, **change) for change in ({"law": "doc"}, {"model": "full"}, {"step": "1/61"}, {"phase": 0.5})),
        replace(cell, scene=moved),
        replace(cell, case=select(["oblique_wall"])[1].scene.name),
    ]
    cache = Cache(tmp_path)
    paths = {cache._path(each, contestant) for each in cells}
    paths.add(cache._path(cell, replace(contestant, profile="default")))
    assert len(paths) == len(cells) + 1


def test_a_changed_engine_misses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its own file, a module that file imports, and a version of an installed package each count."""
    monkeypatch.syspath_prepend(tmp_path)
    engine, part = tmp_path / "engine.py", tmp_path / "part_of_engine.py"
    prints = set()
    texts = (
        ("import part_of_engine", "a = 1"),
        ("import part_of_engine # 2", "a = 1"),
        ("import part_of_engine", "a = 2"),
    )
    for text, imported in texts:
        engine.write_text(text)
        part.write_text(imported)
        sources._spec.cache_clear()
        prints.add(sources.fingerprint.__wrapped__(Contestant("engine", "default", f"{engine}:Engine")))
    (pymunk,) = select_contestants(["pymunk/tuned"])
    prints.add(sources.fingerprint.__wrapped__(pymunk))
    monkeypatch.setattr(sources, "_version", lambda package: f"{package} 99")
    prints.add(sources.fingerprint.__wrapped__(pymunk))
    assert len(prints) == 5


LOADED = """
import sys
from impactbench.adapters.contestants import select
from impactbench.reports import cell

(contestant,) = select([sys.argv[1]])
law = "doc" if contestant.engine == "reference" else "nc"
outcome = cell.run_cell((cell.Cell(sys.argv[2], law, contestant.name, "minimal", "1/60"), contestant))
assert outcome["state"] == "ok", outcome
print(*(name for name in sys.modules if name.startswith("impactbench.")))
"""


@pytest.mark.parametrize("contestant", [c for c in CONTESTANTS if c.profile != "default"], ids=lambda c: c.name)
def test_every_module_a_run_loads_counts(contestant: Contestant) -> None:
    """What a child really imports while it runs a cell is within what was found by reading import statements."""
    texts: dict[str, str] = {}
    for root in (sources.MEASURING, contestant.factory.rpartition(":")[0]):
        sources._follow(root, texts, set())
    words = [sys.executable, "-c", LOADED, contestant.name, select(["oblique_wall"])[0].scene.name]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    loaded = set(done.stdout.splitlines()[-1].split())
    assert len(loaded) > 20
    assert loaded <= set(texts)


def test_the_number_of_children_changes_no_bit() -> None:
    plan = plan_of(select_contestants(["pymunk", "reference"]), ("bouncing_ball",))
    first, second = (comparison.compare(replace(plan, jobs=jobs), "test") for jobs in (1, 3))
    assert first["rows"] == second["rows"]
    assert first["cells"] == second["cells"]
    assert len(first["rows"]) > 50
