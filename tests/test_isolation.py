"""Real children, real deaths. The functions at the top are jobs: children import this file by name."""

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from impactbench.adapters.isolation import Job, Outcome, run_jobs

HERE = Path(__file__).stem
GIB = 2**30


def square(number: float) -> tuple[float, int]:
    return number * number, os.getpid()


def segfault(_: object) -> None:
    ctypes.string_at(0)


def kill_self(name: str) -> None:
    os.kill(os.getpid(), getattr(signal, name))


def leave(status: int) -> None:
    os._exit(status)


def sys_exit(status: int) -> None:
    sys.exit(status)


def hang(_: object) -> None:
    time.sleep(1000)


def hang_with_child(path: str) -> None:
    Path(path).write_text(str(subprocess.Popen(["sleep", "1000"]).pid))
    time.sleep(1000)


def fail(message: str) -> None:
    raise LookupError(message)


def eat(_: object) -> None:
    hoard = []
    while True:
        hoard.append(bytearray(2**20))


def eat_at_once(_: object) -> None:
    bytearray(64 * GIB)


def chatter(text: str) -> str:
    os.write(1, text.encode())
    os.write(2, text.encode())
    print(text, flush=True)
    return os.environ["OMP_NUM_THREADS"] + sys.stdin.read()


class Sour:
    """Can be pickled, cannot be read back."""

    def __reduce__(self) -> tuple[object, ...]:
        return fail, ("sour",)


def answer_sour(_: object) -> Sour:
    return Sour()


def answer_lambda(_: object) -> object:
    return lambda: None


def job(key: str, function: str, argument: object = None, limit: float = 30.0, lane: str = "a") -> Job:
    return Job(key, lane, f"{HERE}:{function}", argument, limit)


def outcomes(jobs: list[Job], workers: int = 2, memory_limit: int | None = None) -> dict[str, Outcome]:
    found = list(run_jobs(jobs, workers, memory_limit))
    assert sorted(o.key for o in found) == sorted(j.key for j in jobs), "one outcome for each job"
    return {outcome.key: outcome for outcome in found}


def gone(pid: int) -> bool:
    """No such process, or a zombie that is not ours (its reaper may take a moment)."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except (FileNotFoundError, ProcessLookupError):
        return True


EARLIER: set[int] = set()
"""Children that run for the whole session: a browser, say."""


@pytest.fixture(autouse=True)
def _leave_out_earlier_children() -> None:
    EARLIER.clear()
    EARLIER.update(children())


def children() -> set[int]:
    """Every process that this one has started since the test began, zombies included."""
    found = set()
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except (FileNotFoundError, ProcessLookupError):
            continue
        if int(fields[1]) == os.getpid():
            found.add(int(stat.parent.name))
    return found - EARLIER


def eventually(condition: object, seconds: float = 5.0) -> bool:
    assert callable(condition)
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.01)
    return False


def test_each_fault_costs_its_own_key_only():
    faults = {
        "segfault": (job("segfault", "segfault"), "crashed", "SIGSEGV"),
        "killed": (job("killed", "kill_self", "SIGKILL"), "crashed", "SIGKILL"),
        "abort": (job("abort", "kill_self", "SIGABRT"), "crashed", "SIGABRT"),
        "silent": (job("silent", "leave", 0), "crashed", "exited with status 0 without a result"),
        "status": (job("status", "leave", 7), "crashed", "exited with status 7 without a result"),
        "exit": (job("exit", "sys_exit", 3), "error", "SystemExit: 3"),
        "hang": (job("hang", "hang", limit=0.3), "timed out", "no result within 0.3 s"),
        "raise": (job("raise", "fail", "first\nlast"), "error", "LookupError: last"),
        "module": (Job("module", "a", "no_such_module:f", None, 30.0), "error", "ModuleNotFoundError: No module"),
        "name": (job("name", "no_such_name"), "error", "AttributeError: module"),
        "eat": (job("eat", "eat"), "error", "MemoryError"),
        "gulp": (job("gulp", "eat_at_once"), "error", "MemoryError"),
        "sour": (job("sour", "answer_sour"), "crashed", "unreadable result: LookupError: sour"),
        "lambda": (job("lambda", "answer_lambda"), "error", ""),
        "unsendable": (job("unsendable", "square", lambda: None), "error", ""),
    }
    jobs = [fault for fault, _, _ in faults.values()]
    for i in range(20):
        jobs.insert(i * 7 % len(jobs), job(f"healthy {i}", "square", i, lane="ab"[i % 2]))

    found = outcomes(jobs, memory_limit=GIB)

    for key, (_, state, reason) in faults.items():
        assert found[key].state == state, found[key]
        assert found[key].reason.startswith(reason), found[key]
        assert "\n" not in found[key].reason
    for i in range(20):
        outcome = found[f"healthy {i}"]
        assert (outcome.state, outcome.reason) == ("done", ""), outcome
        assert outcome.value[0] == i * i  # type: ignore[index]
    assert not children()


def test_a_healthy_worker_is_kept_on_its_lane_in_order():
    jobs = [job(f"{lane}{i}", "square", i, lane=lane) for i in range(8) for lane in "abc"]
    found = list(run_jobs(jobs, workers=2))
    for lane in "abc":
        mine = [outcome for outcome in found if outcome.key[0] == lane]
        pids = {outcome.value[1] for outcome in mine}  # type: ignore[index]
        assert len(pids) <= 2  # the last lane may get both slots
        if len(pids) == 1:
            assert [outcome.key for outcome in mine] == [f"{lane}{i}" for i in range(8)]
    assert len({outcome.value[1] for outcome in found}) <= 4  # type: ignore[index]


def test_one_worker_starts_once_for_each_lane_and_never_mixes_them():
    jobs = [job(f"{lane}{i}", "square", i, lane=lane) for i in range(4) for lane in "ab"]
    found = list(run_jobs(jobs, workers=1))
    pids = {lane: {o.value[1] for o in found if o.key[0] == lane} for lane in "ab"}  # type: ignore[index]
    assert len(pids["a"]) == len(pids["b"]) == 1
    assert pids["a"] != pids["b"]


def test_a_single_lane_uses_every_worker():
    started = time.monotonic()
    found = outcomes([job(str(i), "hang", limit=0.5) for i in range(4)], workers=4)
    assert {outcome.state for outcome in found.values()} == {"timed out"}
    assert time.monotonic() - started < 1.9  # one after the other: 2 s


def test_large_messages_pass_both_ways():
    megabytes = bytes(5 * 2**20)
    found = outcomes(
        [Job("len", "a", "builtins:len", megabytes, 30.0), Job("back", "a", "builtins:bytes", megabytes, 30)]
    )
    assert found["len"].value == len(megabytes)
    assert found["back"].value == megabytes


def test_no_jobs_no_outcomes_and_no_workers_is_an_error():
    assert list(run_jobs([], workers=2)) == []
    with pytest.raises(ValueError, match="workers must be at least 1, not 0"):
        next(run_jobs([], workers=0))


def test_leaving_early_leaves_no_child():
    with closing(run_jobs([job("quick", "square", 2), job("slow", "hang", lane="b")], workers=2)) as runner:
        assert next(runner).key == "quick"
        assert len(children()) == 2
    assert not children()


def test_a_timeout_kills_what_the_job_started(tmp_path: Path):
    note = tmp_path / "pid"
    assert outcomes([job("hang", "hang_with_child", str(note), limit=1.0)])["hang"].state == "timed out"
    assert eventually(lambda: gone(int(note.read_text())))


def test_chatter_does_not_reach_our_output(capfd):
    outcome = outcomes([job("noise", "chatter", "chatter from C")])["noise"]
    assert outcome.value == "1"  # one thread, an empty stdin
    assert capfd.readouterr() == ("", "")


SCRIPT = f"""
import sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
from impactbench.adapters.isolation import Job, run_jobs
print("main runs", flush=True)
jobs = [Job("pid", "a", "{HERE}:square", 1, 30.0)] + [Job(str(i), "a", "{HERE}:hang", None, 30.0) for i in range(2)]
for outcome in run_jobs(jobs, workers=2):
    print(outcome.value[1], flush=True)
"""


def script(path: Path | None) -> Iterator[subprocess.Popen[str]]:
    """A program without a main guard (as a file, or `-c`), once it has children."""
    if path:
        path.write_text(SCRIPT)
    command = [sys.executable, str(path)] if path else [sys.executable, "-c", SCRIPT]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as program:
        yield program


def grandchildren(pid: int) -> list[int]:
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def test_ctrl_c_ends_promptly_and_leaves_no_child(tmp_path: Path):
    for path in (tmp_path / "program.py", None):
        for program in script(path):
            assert program.stdout
            assert program.stdout.readline() == "main runs\n"
            int(program.stdout.readline())
            assert eventually(lambda: len(grandchildren(program.pid)) == 2)  # noqa: B023 - called here
            pids = grandchildren(program.pid)
            started = time.monotonic()
            program.send_signal(signal.SIGINT)
            output, errors = program.communicate(timeout=5)
            assert time.monotonic() - started < 2
            assert output == ""  # the children did not run the script again
            assert errors.splitlines()[-1] == "KeyboardInterrupt"
            assert not [pid for pid in pids if not gone(pid)]


def test_children_die_with_a_killed_parent():
    for program in script(None):
        assert program.stdout
        program.stdout.readline()
        int(program.stdout.readline())
        pids = grandchildren(program.pid)
        program.kill()
        program.wait()
        assert pids
        assert eventually(lambda: all(gone(pid) for pid in pids))  # noqa: B023 - called here
