"""One table of bad inputs and faults: each gives the documented exit code and one clear line, and loses nothing.

Exit codes: 1 a physics check failed, 2 usage or configuration, 3 could not be measured, 4 no baseline, 5 nothing to
judge. A mistake is one line on stderr; a fault of an engine is one line of what is printed, which names it.
"""

from __future__ import annotations

import json
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from click.testing import CliRunner
from impactbench.reports import compare as comparison
from impactbench.reports import results
from impactbench.reports.cli import main
from test_isolation import eventually, gone, grandchildren
from test_scene_files import BROKEN

FAKES = Path(__file__).parent / "fakes" / "faults.py"
COMMAND = str(Path(sys.executable).parent / "impactbench")
FLIGHT = "free_flight[dimension=1]"
CHECK = ["check", FLIGHT, "--engine"]
COMPARE = ["compare", FLIGHT, "--engine", "pymunk/tuned", "--step", "1/60", "--timing", "none", "--out", "out"]
ACCEPT = ["baseline", "accept", "base.json", FLIGHT, "--engine", "pymunk/tuned"]

Prepare = Callable[[Path], object]


def wrote(name: str, content: str | bytes) -> Prepare:
    return lambda folder: (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())


def changed(**parts: object) -> Prepare:
    """The healthy results file with parts of it replaced, or removed where None."""

    def write(folder: Path) -> None:
        path = folder / "out" / "results.json"
        document = {**json.loads(path.read_text(encoding="utf-8")), **parts}
        path.write_text(json.dumps({key: value for key, value in document.items() if value is not None}))

    return write


def in_the_way(name: str) -> Prepare:
    """A file where a folder has to be: no permission, even root's, gets past it."""

    def block(folder: Path) -> None:
        shutil.rmtree(folder / name, ignore_errors=True)
        (folder / name).write_text("precious")

    return block


def nothing(folder: Path) -> None: ...


def budget(text: str) -> Prepare:
    return wrote("b.toml", text)


BUDGETS = [*CHECK, "pymunk/tuned", "--budgets", "b.toml"]
ENTRY = '[[budget]]\ncheck = "momentum"\nreason = "r"\n'
BASED = [*CHECK, "pymunk/tuned", "--baseline", "base.json"]

# (words, exit code, part of the line that says what is wrong, what is prepared)
MISTAKES: list[tuple[list[str], str, Prepare]] = [
    # command lines, every command
    (["compere"], "compare", nothing),
    (["check", "equal_mases"], "equal_masses", nothing),
    (["check", "--engine", "mujoko"], "mujoco", nothing),
    (["check", "--engine", "mujoco/tund"], "mujoco/tuned", nothing),
    (["check", "--engine", "nowhere.py:Engine"], "no such file", nothing),
    (["check", "--engine", "a:b:c.d"], "is not of the form", nothing),
    (["check", "--step", "-1/60"], "write it as 1/240", nothing),
    (["check", "--step", "nan"], "write it as 1/240", nothing),
    (["check", "--law", "newton"], "doc", nothing),
    (["check", "--profile", "fast"], "tuned", nothing),
    (["check", "--jobs", "-1"], "1<=x", nothing),
    (["check", "--only", "momentm"], "did you mean momentum", nothing),
    (["check", "--until", "0"], "x>0", nothing),
    (["check", "--junit", "nowhere/j.xml"], "No such file or directory", nothing),
    (["check", "--out", "blocked"], "blocked", in_the_way("blocked")),
    (["check", "--no-such-option"], "--no-such-option", nothing),
    (["explain", "momentm"], "did you mean momentum", nothing),
    (["explain", "momentum", "--case", "nothing"], "unknown case", nothing),
    (["explain", "momentum", "--step", "2"], "write it as 1/240", nothing),
    (["baseline", "accept", "base.json", FLIGHT], "--reason", nothing),
    ([*ACCEPT, "--reason", " "], "--reason is empty", nothing),
    (["baseline", "accept", "no/base.json", FLIGHT, "--reason", "r"], "cannot write no/base.json: No such", nothing),
    ([*CHECK, "pymunk/tuned", "--summary", "s.md"], "s.md: it is not UTF-8 text", wrote("s.md", b"\xff\xfe")),
    (["baseline", "acept"], "acept", nothing),
    (["compare", "--timing", "often"], "some", nothing),
    (["compare", "--phases", "0"], "1<=x", nothing),
    (["run", FLIGHT, "--step", "1/60"], "--engine", nothing),
    (["run", FLIGHT, "--engine", "pymunk", "--step", "1/60", "--phase", "2"], "0<=x<=1", nothing),
    (["run", "newtons_cradle[count=5,gap=0]", "--engine", "pymunk", "--step", "1/60", "--phase", "0.5"],
     "--phase must be 0", nothing),
    (["advise", FLIGHT, "--error", "little"], "write it as 1%", nothing),
    (["show", "free_flight"], "one case", nothing),
    (["show"], "CASE", nothing),
    (["conform", "nothing"], "known:", nothing),
    (["reproduce", "bouncng"], "bouncng", nothing),
    (["list", "everything"], "scenarios", nothing),
    (["list", "scenarios", "--pair-laws"], "about engines", nothing),
    (["report"], "FOLDER", nothing),
    (["report", "nowhere"], "results.json", nothing),
    # results files
    (["report", "out"], "not a results file", wrote("out/results.json", "")),
    (["report", "out"], "not a results file", wrote("out/results.json", '{"schema": 1, "cells": [')),
    (["report", "out"], "not a results file", wrote("out/results.json", b"\x80\x81PK\x03\x04")),
    (["report", "out"], "not a results file", wrote("out/results.json", "[" * 100_000)),
    (["report", "out"], "NaN is no JSON number", wrote("out/results.json", '{"schema": 1, "rows": [NaN]}')),
    (["report", "out"], "schema None", wrote("out/results.json", "[]")),
    (["report", "out"], "schema 99", changed(schema=99)),
    (["report", "out"], "no list of cells", changed(cells=None)),
    (["report", "out"], "rows[0] belongs to no cell",
     changed(rows=[{"cell": 7, "measure": "m", "value": 1.0, "unit": "1"}])),
    (["report", "out"], "schema inf", wrote("out/results.json", '{"schema": 1e999}')),
    (["report", "out"], "cells[0] is no table", changed(cells=[1])),
    # budget files
    (BUDGETS, "No such file", nothing),
    (BUDGETS, "is not TOML", budget("[[budget]\n")),
    (BUDGETS, "is not TOML", budget("x = " + "[" * 100_000)),
    (BUDGETS, "unknown key 'budgets'", budget("[[budgets]]\n")),
    (BUDGETS, "unknown key 'limt'", budget(ENTRY + "limt = 1\n")),
    (BUDGETS, "no check is named 'momentm'", budget(ENTRY.replace("momentum", "momentm") + "limit = 1\n")),
    (BUDGETS, "a reason is missing", budget('[[budget]]\ncheck = "momentum"\nlimit = 1\n')),
    (BUDGETS, "give one of", budget(ENTRY + "limit = 1\nfactor = 2\n")),
    (BUDGETS, "a number of at least 0", budget(ENTRY + "limit = nan\n")),
    (BUDGETS, "a number of at least 0", budget(ENTRY + "limit = -1\n")),
    (BUDGETS, "order needs the step", budget(ENTRY + "limit = 1\norder = 1\n")),
    (BUDGETS, "is not TOML", wrote("b.toml", b"\xff\xfe")),
    # places
    (COMPARE, "'out' is a file", in_the_way("out")),
    ([*COMPARE[:-1], "/proc/none"], "choose another folder with --out", nothing),
]  # fmt: skip
SCENES = ["wrong type", "unknown key", "nan", "huge", "negative mass", "missing duration", "syntax", "empty", "binary"]
MISTAKES += [
    (["check", "scene.toml", "--engine", "pymunk"], BROKEN[kind][1].strip(), wrote("scene.toml", BROKEN[kind][0]))
    for kind in SCENES
]

ENGINES: list[tuple[list[str], int, str]] = [
    ([*CHECK, f"{FAKES}:Crashing"], 3, "crashed: SIGSEGV"),
    ([*CHECK, f"{FAKES}:Aborting"], 3, "crashed: SIGABRT"),
    ([*CHECK, f"{FAKES}:Hanging"], 3, "timed out: no result within 2 s"),
    ([*CHECK, f"{FAKES}:Greedy"], 3, "MemoryError: beyond the 4 GiB"),
    ([*CHECK, f"{FAKES}:Leaving"], 3, "exited with status 0 without a result"),
    ([*CHECK, f"{FAKES}:Raising"], 3, "RuntimeError: no such luck"),
    ([*CHECK, f"{FAKES}:Shouting"], 3, "ValueError: last line"),
    ([*CHECK, f"{FAKES}:Interrupting"], 3, "KeyboardInterrupt"),
    ([*CHECK, f"{FAKES}:Misshapen"], 3, "ValueError"),
    ([*CHECK, f"{FAKES}:Empty"], 3, "AttributeError"),
    ([*CHECK, f"{FAKES}:Missing"], 3, "its licence server is down"),
    ([*CHECK, f"{FAKES}:NoSuchClass"], 3, "NoSuchClass"),
    ([*CHECK, f"{FAKES}:Diverging"], 1, "not finite"),
    ([*CHECK, f"{FAKES}:Infinite"], 1, "not finite"),
    ([*CHECK, f"{FAKES}:Refusing"], 5, "1 unsupported"),
]

BASELINES: list[tuple[Prepare, str]] = [
    (nothing, "cannot read baseline"),
    (wrote("base.json", "{"), "is not a baseline"),
    (wrote("base.json", b"\xff"), "is not a baseline"),
    (wrote("base.json", '{"schema": 7}'), "baseline schema 7"),
    (wrote("base.json", '{"schema": 1, "cells": 3, "history": [], "versions": {}}'), "is not a baseline"),
]


@pytest.fixture(scope="module")
def healthy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with results of an earlier run."""
    folder = tmp_path_factory.mktemp("healthy")
    done = CliRunner().invoke(main, [*COMPARE[:-1], str(folder / "out")])
    assert done.exit_code == 0, done.output
    return folder


@pytest.fixture
def earlier(healthy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copytree(healthy / "out", tmp_path / "out")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def contents(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != ".lock")
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def one_line(text: str, hint: str) -> None:
    assert len(text.strip().splitlines()) == 1, text
    assert text.startswith("impactbench: ")
    assert hint in text
    assert "Traceback" not in text


@pytest.mark.parametrize("number", range(len(MISTAKES)), ids=lambda n: f"{n} {' '.join(MISTAKES[n][0])[:60]}")
def test_a_mistake_is_one_line_and_exit_code_2(number: int, earlier: Path) -> None:
    words, hint, prepare = MISTAKES[number]
    prepare(earlier)
    before = contents(earlier)
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 2, done.output
    assert done.stdout == ""
    one_line(done.stderr, hint)
    assert contents(earlier) == before


@pytest.mark.parametrize(("words", "code", "hint"), ENGINES, ids=[row[0][-1].rpartition(":")[2] for row in ENGINES])
def test_a_fault_of_an_engine_is_named_in_one_line(
    words: list[str], code: int, hint: str, earlier: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if words[-1].endswith("Hanging"):
        monkeypatch.setattr(comparison, "CELL_LIMIT", 2.0)
    before = contents(earlier)
    done = CliRunner().invoke(main, words)
    assert done.exit_code == code, done.output
    assert done.stderr == ""
    assert len([line for line in done.stdout.splitlines() if hint in line]) >= 1, done.stdout
    assert "Traceback" not in done.stdout
    assert re.search(r"\d+ passed, \d+ failed, \d+ error", done.stdout)  # counts are always there
    assert contents(earlier) == before


@pytest.mark.parametrize("number", range(len(BASELINES)))
def test_no_baseline_to_compare_with_is_exit_code_4(number: int, earlier: Path) -> None:
    prepare, hint = BASELINES[number]
    prepare(earlier)
    before = contents(earlier)
    done = CliRunner().invoke(main, BASED)
    assert done.exit_code == 4, done.output
    assert len([line for line in done.stdout.splitlines() if hint in line]) == 1, done.stdout
    assert contents(earlier) == before


def test_a_baseline_that_cannot_be_read_is_not_written_over(earlier: Path) -> None:
    (earlier / "base.json").write_text("{")
    done = CliRunner().invoke(main, [*ACCEPT, "--reason", "r"])
    assert done.exit_code == 2, done.output
    one_line(done.stderr, "is not a baseline")
    assert (earlier / "base.json").read_text() == "{"


def test_an_engine_that_cannot_be_measured_leaves_the_baseline_as_it_was(earlier: Path) -> None:
    (earlier / "base.json").write_text("{}")
    done = CliRunner().invoke(main, [*ACCEPT[:-1], f"{FAKES}:Raising", "--reason", "r"])
    assert done.exit_code == 3
    assert (earlier / "base.json").read_text() == "{}"


# --- disks ---


@pytest.fixture
def small_disk(earlier: Path) -> Iterator[Path]:
    """The folder of earlier results on a disk of its own, as large as they are and 64 kB."""
    size = sum(len(content) for content in contents(earlier / "out").values()) + 2**16
    kept = contents(earlier / "out")
    size += 2**14 * len(kept)  # folders and ends of blocks
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(earlier / "out")]
    done = subprocess.run(mount, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"no small disk can be mounted here: {done.stderr.strip()}")
    try:
        for name, content in kept.items():
            (earlier / "out" / name).parent.mkdir(parents=True, exist_ok=True)
            (earlier / "out" / name).write_bytes(content)
        yield earlier
    finally:
        subprocess.run(["umount", "-l", str(earlier / "out")], check=True)


@pytest.mark.parametrize(
    "words", [COMPARE, ["report", "out"], ["check", FLIGHT, "--engine", "pymunk/tuned", "--junit", "out/j.xml"]]
)
def test_a_full_disk_is_one_line_and_earlier_results_stay(words: list[str], small_disk: Path) -> None:
    before = contents(small_disk / "out")
    filling = small_disk / "out" / "filling"
    with filling.open("wb", buffering=0) as stream, suppress(OSError):
        while True:
            stream.write(bytes(4096))
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 2, done.output
    one_line(done.stderr, "No space left on device")
    filling.unlink()
    assert contents(small_disk / "out") == before


@pytest.mark.parametrize("words", [COMPARE, ["report", "out"]])
def test_a_disk_that_can_only_be_read_is_one_line(words: list[str], small_disk: Path) -> None:
    before = contents(small_disk / "out")
    subprocess.run(["mount", "-o", "remount,ro", str(small_disk / "out")], check=True)
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 2, done.output
    one_line(done.stderr, "Read-only file system")
    assert contents(small_disk / "out") == before


def test_an_output_that_is_full_is_one_line() -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([COMMAND, "--help"], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    one_line(done.stderr, "No space left on device")


# --- ends from outside ---


@pytest.fixture
def hanging(earlier: Path) -> Iterator[tuple[subprocess.Popen[str], list[int]]]:
    """A comparison into the folder of earlier results, at the moment its child is at work."""
    words = [COMMAND, "compare", FLIGHT, "--engine", f"{FAKES}:Hanging", "--out", "out", "--jobs", "1"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as program:
        try:
            assert eventually(lambda: len(grandchildren(program.pid)) == 1, 30)
            yield program, grandchildren(program.pid)
        finally:
            program.kill()


def test_ctrl_c_is_130_and_leaves_no_child(hanging: tuple[subprocess.Popen[str], list[int]], earlier: Path) -> None:
    program, pids = hanging
    before = contents(earlier)
    program.send_signal(signal.SIGINT)
    output, errors = program.communicate(timeout=10)
    assert program.returncode == 130
    assert (output, errors.strip()) == ("", "impactbench: interrupted")
    assert all(gone(pid) for pid in pids)
    assert contents(earlier) == before


def test_two_runs_in_one_folder_the_second_says_so_and_a_killed_one_leaves_it_free(
    hanging: tuple[subprocess.Popen[str], list[int]], earlier: Path
) -> None:
    program, pids = hanging
    before = contents(earlier)
    second = CliRunner().invoke(main, COMPARE)
    assert second.exit_code == 2, second.output
    one_line(second.stderr, "another run is writing to out")
    program.kill()
    program.wait()
    assert eventually(lambda: all(gone(pid) for pid in pids))
    assert contents(earlier) == before
    (earlier / "out" / ".results.json.abcdefgh").write_text("half a fi")  # as a kill in the middle of writing leaves
    assert CliRunner().invoke(main, COMPARE).exit_code == 0
    assert not (earlier / "out" / ".results.json.abcdefgh").exists()
    assert results.read(earlier / "out" / "results.json")["cells"]


WRITER = """
import sys
from pathlib import Path
from impactbench.reports import results
for i in range(int(sys.argv[2]), 10**9):
    results.save({"schema": 1, "run": i, "rows": [i] * 20000, "end": i}, Path(sys.argv[1]))
"""


def test_a_kill_at_any_moment_leaves_a_whole_file(tmp_path: Path) -> None:
    """Twelve kills of a program that writes again and again, each at another part of the some 5 ms a file takes."""
    path = tmp_path / "results.json"

    def last() -> int:
        document = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {"run": -1}
        assert document["run"] == -1 or document["run"] == document["end"] == document["rows"][-1]
        return int(document["run"])

    for k in range(12):
        with subprocess.Popen([sys.executable, "-c", WRITER, str(path), str(1000000 * k)]) as program:
            assert eventually(lambda k=k: last() > 1000000 * k, 30)
            time.sleep(k * 0.0037)
            program.kill()
        assert last() > 1000000 * k


def test_the_table_holds_what_it_promises() -> None:
    assert len(MISTAKES) + len(ENGINES) + len(BASELINES) + 11 >= 60
