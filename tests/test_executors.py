"""Cells on executors: pools and a real cluster give the rows of a local run; lost workers cost nothing or are named."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest
from impactbench.adapters.contestants import select as select_contestants
from impactbench.reference import warm_up
from impactbench.reports import compare as comparison
from impactbench.reports import executors
from impactbench.reports.cache import Cache
from impactbench.scenarios.catalogue import select

FAKES = Path(__file__).parent / "fakes" / "faults.py"
PLAN = comparison.Plan(
    select(["static_wall"])[:2],
    select_contestants(["pymunk/tuned", f"{FAKES}:Crashing", f"{FAKES}:Honest"]),
    ("1/30", "1/60"),
    jobs=2,
    timing="none",
)


@pytest.fixture(scope="module")
def local() -> dict[str, Any]:
    document = comparison.compare(PLAN, "test")
    states = {cell["contestant"]: cell["state"] for cell in document["cells"]}
    assert states == {"pymunk/tuned": "ok", "Crashing/default": "crashed", "Honest/default": "ok"}
    return dict(json.loads(json.dumps(document)))


def test_a_pool_of_processes_gives_the_same_rows(local: dict[str, Any]) -> None:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        document = comparison.compare(PLAN, "test", executor=pool)
    assert document["rows"] == local["rows"]
    assert document["cells"] == local["cells"]


class Losing(Executor):
    """Loses the first `count` chunks it is given, as a worker that dies does."""

    def __init__(self, count: int) -> None:
        self.count = count

    def submit(self, call: Any, /, *words: Any, **named: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.count -= 1
        if self.count >= 0:
            future.set_exception(ConnectionError("worker gone"))
        else:
            future.set_result(call(*words, **named))
        return future


def test_a_lost_chunk_is_run_again_and_a_hopeless_one_is_named_but_not_kept(tmp_path: Path) -> None:
    plan = replace(PLAN, contestants=select_contestants(["pymunk/tuned"]))
    chunks = 1  # one lane, fewer cells than a chunk takes
    assert len(plan.cells()) <= executors.CHUNK
    for lost, states in ((chunks, {"ok"}), (2 * chunks, {"error"})):
        cache = Cache(tmp_path / str(lost))
        document = comparison.compare(plan, "test", executor=Losing(lost), cache=cache)
        assert {cell["state"] for cell in document["cells"]} == states
        reasons = {cell["reason"] for cell in document["cells"]}
        assert reasons == ({""} if states == {"ok"} else {"no worker could run it: ConnectionError: worker gone"})
        assert len(list(cache.folder.glob("??/*"))) == (len(document["cells"]) if states == {"ok"} else 0)


def test_a_worker_with_other_versions_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    (contestant,) = select_contestants(["pymunk/tuned"])
    with pytest.raises(executors.ClusterError, match="other versions of pymunk/tuned"):
        executors.run_chunk([], {contestant: "the print of another machine"})


# The comparison as --scheduler runs it, without the page.
SWEEP = """
import json, sys
from impactbench.reports import compare
from impactbench.reports.cli_sweep import Sweep
from impactbench.adapters.contestants import select as contestants
from impactbench.scenarios.catalogue import select

address, fakes = sys.argv[1:]
plan = compare.Plan(select(["static_wall"])[:2], contestants(["pymunk/tuned", fakes + ":Crashing", fakes + ":Honest"]),
                    ("1/30", "1/60"), timing="none")
with Sweep(False, None, True, None, address, False).executor() as executor:
    document = compare.compare(plan, "test", executor=executor)
print(json.dumps(document))
"""


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Address of a real scheduler, and its two workers, all processes of their own."""
    book = tmp_path / "scheduler.json"
    dask = [sys.executable, "-m", "dask"]
    words = ["--scheduler-file", str(book), "--no-dashboard"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    scheduler = subprocess.Popen([*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", *words], **quiet)
    workers = [subprocess.Popen([*dask, "worker", *words, "--nthreads", "1", "--no-nanny"], **quiet) for _ in range(2)]
    try:
        deadline = time.monotonic() + 30
        while not (book.exists() and book.read_text()) and time.monotonic() < deadline:
            time.sleep(0.02)
        yield json.loads(book.read_text())["address"], workers
    finally:
        for process in (*workers, scheduler):
            process.kill()
            process.wait()


def children(pid: int) -> list[int]:
    lists = [path.read_text() for path in Path(f"/proc/{pid}/task").glob("*/children")]
    return [int(child) for text in lists for child in text.split()]


def runs(pid: int) -> bool:
    """Whether the process is alive; one that is dead keeps its number until its new parent has asked for its status."""
    try:
        status = Path(f"/proc/{pid}/stat").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return False
    return status.rpartition(")")[2].split()[0] not in "ZX"


def test_a_cluster_that_loses_a_worker_gives_the_rows_of_a_local_run(
    cluster: tuple[str, list[subprocess.Popen[bytes]]], local: dict[str, Any]
) -> None:
    """The worker is killed while a child of its own runs an engine; that child goes with it."""
    address, workers = cluster
    sweep = subprocess.Popen([sys.executable, "-c", SWEEP, address, str(FAKES)], stdout=subprocess.PIPE)
    deadline = time.monotonic() + 60
    busy: list[int] = []
    while not busy and sweep.poll() is None and time.monotonic() < deadline:
        busy = children(workers[0].pid)
    assert busy, "the worker had nothing to do before the sweep was over"
    workers[0].send_signal(signal.SIGKILL)
    assert workers[0].wait() == -signal.SIGKILL
    text, _ = sweep.communicate(timeout=60)
    assert sweep.returncode == 0
    document = json.loads(text)
    assert document["rows"] == local["rows"]
    assert document["cells"] == local["cells"]
    deadline = time.monotonic() + 10
    while runs(busy[0]) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not runs(busy[0])


@pytest.mark.parametrize(
    ("address", "said"), [("tcp://127.0.0.1:1", "no scheduler answers at"), ("nonsense", "no scheduler answers at")]
)
def test_a_scheduler_that_is_not_there_is_named(address: str, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executors, "PATIENCE", 0.5)
    with pytest.raises(executors.ClusterError, match=said), executors.cluster(address):
        pass


def test_a_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    extra = r"pip install 'impactbench\[cluster\]'"
    with pytest.raises(executors.ClusterError, match=extra), executors.cluster("tcp://127.0.0.1:1"):
        pass


def test_every_part_of_the_kernels_is_compiled_before_clocks_run() -> None:
    assert [job.argument for job in executors.WARM_UPS] == list(warm_up.PARTS)
