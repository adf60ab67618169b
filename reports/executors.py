"""The accuracy lane on any `concurrent.futures.Executor`: a pool of processes, or the workers of a cluster.

A worker never runs an engine itself: it runs a chunk of cells in a child process of its own, so that a crash costs its
cell there as it does here. A worker that is lost costs nothing that another cannot do again.
"""

from __future__ import annotations

import socket
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import Executor, as_completed
from contextlib import contextmanager, suppress
from typing import Any

from impactbench.adapters.contestants import Contestant
from impactbench.adapters.isolation import Job, Outcome, run_jobs
from impactbench.reports.sources import fingerprint

CHUNK = 24
"""Jobs of one lane that a worker takes at once: they share one child, whose start costs as much as some 30 cells."""
LOST = "no worker could run it"
WARM_UPS = [
    Job(f"warm-up {part}", "reference", "impactbench.reference.warm_up:warm_up", part, 600.0)
    for part in ("turning", "exact", "particles", "gas")
]
"""Compile the reference's kernels before any cell's clock runs: a minute and a half of processor time the first time,
then stored. The parts do not wait for one another; they are those of `warm_up`, which is not imported only to be named.
"""
PATIENCE = 10.0  # [s] until a scheduler must have answered


class ClusterError(Exception):
    """A cluster cannot be used. One line: what, where, what is possible instead."""


def run_on(executor: Executor, jobs: Sequence[Job], size: int = CHUNK) -> Generator[Outcome, None, None]:
    """One outcome for each job, as their chunks of `size` finish. A chunk whose worker is lost is sent once more."""
    chunks = _chunks(jobs, size)
    for attempt in (1, 2):
        lost: list[list[Job]] = []
        reason = ""
        for chunk, result in _submitted(executor, chunks):
            if isinstance(result, Exception):
                lost.append(chunk)
                reason = f"{LOST}: {type(result).__name__}: {' '.join(str(result).split())}"
            else:
                yield from result
        if attempt == 2:
            yield from (Outcome(job.key, "error", None, reason, 0.0) for chunk in lost for job in chunk)
        chunks = lost


def _submitted(
    executor: Executor, chunks: Sequence[list[Job]]
) -> Iterator[tuple[list[Job], list[Outcome] | Exception]]:
    futures: dict[Any, list[Job]] = {}
    for chunk in chunks:
        try:
            futures[executor.submit(run_chunk, chunk, expected(chunk))] = chunk
        except Exception as why:  # a broken pool takes nothing
            yield chunk, why
    try:
        for future in as_completed(futures):
            try:
                result = future.result()
            except ClusterError:
                raise
            except Exception as why:
                yield futures[future], why
            else:
                yield futures[future], result
    finally:
        for future in futures:
            future.cancel()


def _chunks(jobs: Sequence[Job], size: int) -> list[list[Job]]:
    lanes: dict[str, list[Job]] = {}
    for job in jobs:
        lanes.setdefault(job.lane, []).append(job)
    return [lane[start : start + size] for lane in lanes.values() for start in range(0, len(lane), size)]


def expected(chunk: Sequence[Job]) -> dict[Contestant, str]:
    """The fingerprint here of every contestant a chunk is about."""
    return {contestant: fingerprint(contestant) for job in chunk for contestant in _contestants(job.argument)}


def _contestants(argument: object) -> Iterator[Contestant]:
    if isinstance(argument, Contestant):
        yield argument
    elif isinstance(argument, (tuple, list)):
        for part in argument:
            yield from _contestants(part)


def run_chunk(jobs: Sequence[Job], prints: dict[Contestant, str]) -> list[Outcome]:
    """What a worker does. Raises ClusterError where its code is not ours: its figures would not be ours either."""
    for contestant, wanted in prints.items():
        if fingerprint(contestant) != wanted:
            raise ClusterError(
                f"worker {socket.gethostname()} has other versions of {contestant.name}, of its packages or of "
                "impactbench than this machine: install the same ones there"
            )
    compiling = any(contestant.engine == "reference" for contestant in prints)
    first = WARM_UPS if compiling else []
    kept = {job.key for job in jobs}
    return [outcome for outcome in run_jobs([*first, *jobs], 1) if outcome.key in kept]


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """The workers of the dask.distributed scheduler at `address` as an executor. Raises ClusterError."""
    try:
        import distributed
        from distributed.comm.addressing import parse_address, parse_host_port
    except ImportError:
        raise ClusterError("--scheduler needs dask.distributed: pip install 'impactbench[cluster]'") from None
    import logging

    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # lost workers are ours to tell of
    try:
        parse_host_port(parse_address(address)[1])  # a client made with a bad address complains for good
        client = distributed.Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as why:
        reason = " ".join(str(why).split()) or type(why).__name__
        raise ClusterError(f"no scheduler answers at {address} ({reason}); `dask scheduler` starts one") from None
    try:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise ClusterError(f"the scheduler at {address} has no workers; `dask worker {address}` adds one") from None
        with client.get_executor(pure=False) as executor:
            yield executor
    finally:
        with suppress(Exception):
            client.close()
