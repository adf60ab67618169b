"""Jobs in reusable child processes, so that an engine that crashes, hangs or eats all memory costs its own cell only.

A child is a plain interpreter that talks over a socket pair. `multiprocessing.Process` is avoided: fork would copy our
threads' locks, spawn would import the caller's `__main__` again. A child serves one lane and is kept while healthy.
There is one way to stop a child, busy or idle: SIGKILL to its process group. It has nothing to save.
"""

from __future__ import annotations

import ctypes
import importlib
import os
import pickle
import resource
import signal
import subprocess
import sys
import time
from collections import Counter, deque
from collections.abc import Generator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, Pipe, wait
from operator import attrgetter
from typing import Any, Literal

LONGEST_WAIT = 60.0  # [s] poll() takes no infinite timeout, a job's limit may be infinite
MEMORY_LIMIT = 4 * 2**30
"""[bytes] A healthy cell takes up to 0.3 GB with its engine, the largest scene that is measured 3 GB more."""
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
# Our search path goes first: without it the child may find another `impactbench`, or none.
BOOT = """\
import sys
from multiprocessing.connection import Connection
pipe = Connection(int(sys.argv[1]))
sys.path[:], parent, memory_limit = pipe.recv()
from impactbench.adapters.isolation import serve
serve(pipe, parent, memory_limit)
"""
PR_SET_PDEATHSIG = 1
State = Literal["done", "crashed", "timed out", "error"]


@dataclass(frozen=True)
class Job:
    key: str
    lane: str  # jobs of one lane may share a child: the engine's name
    call: str  # "package.module:function", imported in the child only
    argument: object
    limit: float  # [s] until the answer; a new child spends some on starting and importing


@dataclass(frozen=True)
class Outcome:
    key: str
    state: State
    value: object
    reason: str  # one line, empty when done
    seconds: float  # in the call itself; from being sent, where the child could not tell


def run_jobs(
    jobs: Sequence[Job], workers: int, memory_limit: int | None = MEMORY_LIMIT
) -> Generator[Outcome, None, None]:
    """Run each job in one of `workers` children; yield one outcome for each, as they finish.

    `memory_limit` [bytes] bounds what a child may write to (on Linux; reserved address space is not counted, as engines
    reserve far more than they use): a job beyond it ends as error, MemoryError, or crashes in its engine's own code.
    Leaving the loop early (`close`, an exception, Ctrl-C) kills the children. Iterate in a thread that outlives the
    loop: on Linux children die with the thread that started them.
    """
    if workers < 1:
        raise ValueError(f"workers must be at least 1, not {workers}")
    pool = _Pool(jobs, workers, memory_limit)
    finished: list[Outcome] = []
    try:
        while True:
            finished += pool.assign()  # before yielding: children work while the caller does
            yield from finished
            if not pool.busy():
                return
            finished = pool.collect()
    finally:
        pool.close()


class _Worker:
    """One child and the job it has."""

    def __init__(self, lane: str, memory_limit: int | None) -> None:
        self.lane = lane
        self.job: Job | None = None
        self.sent = 0.0
        self.pipe, theirs = Pipe()
        self.pipe.send((sys.path, os.getpid(), memory_limit))  # small: fits in the socket's buffer before anyone reads
        quiet = subprocess.DEVNULL  # engines print from C: it must not reach our own output
        with theirs:
            self.process = subprocess.Popen(
                [sys.executable, "-P", "-c", BOOT, str(theirs.fileno())],
                stdin=quiet,
                stdout=quiet,
                stderr=quiet,
                pass_fds=[theirs.fileno()],
                env=os.environ | ONE_THREAD,
                start_new_session=True,  # its own group: killed whole, and the terminal's Ctrl-C comes to us alone
            )

    def give(self, job: Job, message: bytes) -> None:
        self.job, self.sent = job, time.monotonic()
        with suppress(OSError):  # a child that died shows as end of file at the next read
            self.pipe.send_bytes(message)

    def patience(self) -> float:
        """Seconds until the job is out of time."""
        return self.sent + self.job.limit - time.monotonic() if self.job else LONGEST_WAIT

    def hear(self) -> Outcome:
        """Read what the child said: the job's outcome, or (end of file) that it is gone."""
        try:
            message = self.pipe.recv_bytes()
        except (EOFError, OSError):
            return self.end("crashed", None, self.cause_of_death())
        try:
            return self.end(*pickle.loads(message))
        except Exception as fault:
            return self.end("crashed", None, f"unreadable result: {_describe(fault)}")

    def end(self, state: State, value: object, reason: str, seconds: float | None = None) -> Outcome:
        assert self.job is not None
        outcome = Outcome(
            self.job.key, state, value, reason, time.monotonic() - self.sent if seconds is None else seconds
        )
        self.job = None
        return outcome

    def cause_of_death(self) -> str:
        self.kill()  # one that is already dead keeps its own status
        status = self.process.wait()
        if status >= 0:
            return f"exited with status {status} without a result"
        return next((s.name for s in signal.Signals if s == -status), f"signal {-status}")

    def kill(self) -> None:
        # The group may outlive the child (processes it started); its id is nobody else's until the child is reaped.
        if self.process.returncode is None:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.process.pid, signal.SIGKILL)


class _Pool:
    """The children, and the jobs that wait for one."""

    def __init__(self, jobs: Sequence[Job], slots: int, memory_limit: int | None) -> None:
        self.slots = slots
        self.memory_limit = memory_limit
        self.workers: list[_Worker] = []
        self.waiting: dict[str, deque[Job]] = {}  # by lane; no empty queues
        for job in jobs:
            self.waiting.setdefault(job.lane, deque()).append(job)

    def busy(self) -> list[_Worker]:
        return [worker for worker in self.workers if worker.job]

    def assign(self) -> list[Outcome]:
        """Give jobs to children until one of the two runs out; return outcomes of jobs that could not be given."""
        refused = []
        while self.waiting:
            worker = next((idle for idle in self._idle() if idle.lane in self.waiting), None)
            if worker is None and not self._make_room():
                break
            job = self._take(worker.lane if worker else self._neediest_lane())
            try:
                message = pickle.dumps((job.call, job.argument))
                (worker or self._start(job.lane)).give(job, message)
            except Exception as fault:
                refused.append(Outcome(job.key, "error", None, _describe(fault), 0.0))
        return refused

    def collect(self) -> list[Outcome]:
        """Wait until a child has news or is out of time; return the outcomes this brings."""
        busy = self.busy()
        patience = min(worker.patience() for worker in busy)
        news = wait([worker.pipe for worker in busy], min(max(patience, 0.0), LONGEST_WAIT))
        outcomes = []
        for worker in busy:
            if worker.pipe in news:
                outcome = worker.hear()
            elif worker.job and worker.patience() <= 0.0:
                outcome = worker.end("timed out", None, f"no result within {worker.job.limit:g} s")
            else:
                continue
            outcomes.append(outcome)
            if outcome.state not in ("done", "error") or outcome.reason.startswith("MemoryError"):
                self._drop(worker)
        return outcomes

    def close(self) -> None:
        for worker in self.workers:  # all of them first: a second Ctrl-C must find nothing alive
            worker.kill()
        while self.workers:
            self._drop(self.workers[-1])

    def _idle(self) -> list[_Worker]:
        return [worker for worker in self.workers if not worker.job]

    def _make_room(self) -> bool:
        """A free slot, if need be that of an idle child: none changes its lane, so no two engines share a process."""
        if len(self.workers) == self.slots and (idle := self._idle()):
            self._drop(idle[0])
        return len(self.workers) < self.slots

    def _neediest_lane(self) -> str:
        served = Counter(worker.lane for worker in self.workers)
        return min(self.waiting, key=lambda lane: (served[lane], -len(self.waiting[lane])))

    def _take(self, lane: str) -> Job:
        job = self.waiting[lane].popleft()
        if not self.waiting[lane]:
            del self.waiting[lane]
        return job

    def _start(self, lane: str) -> _Worker:
        worker = _Worker(lane, self.memory_limit)
        self.workers.append(worker)
        return worker

    def _drop(self, worker: _Worker) -> None:
        worker.kill()
        worker.process.wait()
        worker.pipe.close()
        self.workers.remove(worker)


def serve(pipe: Connection[Any, Any], parent: int, memory_limit: int | None) -> None:
    """The child's whole life: answer until the pipe closes."""
    if sys.platform == "linux":  # elsewhere a child notices at its next read that we are gone
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # gone before we asked to be told
        return
    os.set_inheritable(pipe.fileno(), False)  # what a job starts must not hold the pipe open
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # a crash is an expected result, not one to debug from here
    if memory_limit is not None and sys.platform == "linux":
        resource.setrlimit(resource.RLIMIT_DATA, (memory_limit, memory_limit))
    with suppress(EOFError):
        while True:
            pipe.send_bytes(_answer(pipe.recv_bytes(), memory_limit))


def _answer(message: bytes, memory_limit: int | None) -> bytes:
    started = time.perf_counter()
    try:
        call, argument = pickle.loads(message)
        module, _, name = call.partition(":")
        function = attrgetter(name)(importlib.import_module(module))
        started = time.perf_counter()
        value = function(argument)
        return pickle.dumps(("done", value, "", time.perf_counter() - started))
    except BaseException as fault:  # SystemExit too: a job must not end the child in silence
        seconds = time.perf_counter() - started
        fault.__traceback__ = None  # frees what the job held: after a MemoryError the answer needs some
        reason = _describe(fault)
        if memory_limit is not None and isinstance(fault, MemoryError):
            reason = f"MemoryError: beyond the {memory_limit / 2**30:g} GiB that a job may take"
        return pickle.dumps(("error", None, reason, seconds))


def _describe(fault: BaseException) -> str:
    """`TypeName: message` in one line, the message's last."""
    name = "MemoryError" if isinstance(fault, MemoryError) else type(fault).__name__  # numpy has a subclass
    lines = str(fault).strip().splitlines()
    return f"{name}: {lines[-1].strip()}" if lines else name
