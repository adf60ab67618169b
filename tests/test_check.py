"""`impactbench check` as CI meets it: real processes, real engines, the documented exit code for everything."""

from __future__ import annotations

import json
import os
import re
import resource
import shlex
import signal
import subprocess
import sys
import time
from contextlib import chdir
from pathlib import Path

import pytest
from click.testing import CliRunner
from impactbench.reports.cli import main
from junitparser import Failure, JUnitXml, Skipped

HERE = Path(__file__).parent
FAKES = HERE / "fakes" / "gated.py"
FAULTS = HERE / "fakes" / "faults.py"
BIN = Path(sys.executable).parent
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "GITHUB_ACTIONS"} | {
    "PATH": f"{BIN}{os.pathsep}{os.environ['PATH']}"
}


def impactbench(*words: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """The command in a process of its own, as everybody meets it."""
    command = [str(BIN / "impactbench"), *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, cwd=cwd, env=ENVIRONMENT)


def here(*words: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """The same command line in this process; cells still run in children."""
    with chdir(cwd or Path.cwd()):
        done = CliRunner(env={"GITHUB_ACTIONS": ""}).invoke(main, [*map(str, words)])
    return subprocess.CompletedProcess(words, done.exit_code, done.stdout, done.stderr)


def one_line(done: subprocess.CompletedProcess[str]) -> str:
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    return done.stderr


def test_the_three_engines_pass_and_every_output_is_as_ci_reads_it(tmp_path: Path) -> None:
    """One case of each kind of check. The whole catalogue is what the workflow's `physics` job runs."""
    import xmlschema

    cases = ["oblique_pair[offset=0.5,bounciness=0.5]", "stacked_drop[shape=box,count=3]", "coulomb_slide[heading=45]"]
    cases += ["rolling_onset[friction=0.3]", "bouncing_ball[bounciness=0.8]"]
    engines = [word for name in ("pybullet", "mujoco", "pymunk", "reference") for word in ("--engine", name)]
    done = impactbench("check", *cases, *engines, "--junit", "j.xml", "--summary", "s.md", "--margins", cwd=tmp_path)
    assert done.returncode == 0, done.stdout
    assert " 0 failed, 0 error, 0 unavailable" in done.stdout
    xmlschema.validate(str(tmp_path / "j.xml"), str(HERE / "data" / "junit.xsd"))
    suites = list(JUnitXml.fromfile(str(tmp_path / "j.xml")))
    assert len(suites) == 5 * len(cases)  # the reference has a stepped and an exact runner
    figures = {p.name: p.value for p in suites[0].properties()}
    assert 0 <= float(figures["momentum momentum_drift"]) <= float(figures["momentum budget"])
    assert "impactbench check: passed" in (tmp_path / "s.md").read_text()
    assert subprocess.run(["sh", tmp_path / "failures.sh"], check=False).returncode == 0


def test_a_failure_names_law_numbers_time_bodies_and_a_command_that_shows_it_again(tmp_path: Path) -> None:
    done = impactbench(
        "check", "equal_masses[bounciness=0.5]", "--engine", f"{FAKES}:Dull", "--junit", "j.xml", "--annotations",
        "--only", "restitution", "--only", "impact",
        cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 1
    found = re.search(r"FAILED restitution: .* restitution_error 0\.005, budget 1\.78e-13; (.*)\n +(.*)\n", done.stdout)
    assert found is not None, done.stdout
    assert found[1] == "first at t = 0.2792 s; bodies A, B"  # A meets B 0.83 m away at 3 m/s: t = 0.2767 s, + one step
    command = shlex.split(found[2])
    assert command[command.index("--until") + 1] == "0.279166667"
    again = here(*command[1:], "--json")
    assert again.returncode == 1
    (told,) = json.loads(again.stdout)["findings"]
    assert (told["bodies"], told["verdict"]["check"]) == (["A", "B"], "restitution")
    assert told["time"] == pytest.approx(67 / 240)
    assert told["shortest"] == found[2]
    earlier = ["0.275" if word == "0.279166667" else word for word in command]
    assert here(*earlier[1:]).returncode != 1  # one step less shows nothing: it is the shortest run
    suite = next(iter(JUnitXml.fromfile(str(tmp_path / "j.xml"))))
    failed = {case.name: case.result[0] for case in suite if case.result}
    assert failed.keys() == {"restitution", "impact"}
    assert isinstance(failed["restitution"], Failure)
    assert failed["restitution"].message == "restitution_error 0.005, budget 1.78e-13"
    assert subprocess.run(["sh", tmp_path / "failures.sh"], env=ENVIRONMENT, capture_output=True).returncode == 1
    assert len([line for line in done.stdout.splitlines() if line.startswith("::error ")]) == 3  # and one of all counts


def test_a_failing_stack_is_shown_with_the_fewest_bodies() -> None:
    """Slop 1 cm: three boxes sink as well as ten, and three are the fewest in the catalogue."""
    done = here("check", "stacked_drop[shape=box,count=10]", "--engine", f"{FAKES}:Sinking")
    assert done.returncode == 1
    (command,) = re.findall(r"    impactbench check '(.*)' .*--only rest-heights", done.stdout)
    assert command == "stacked_drop[shape=box,count=3]"


@pytest.mark.parametrize(
    ("words", "code", "hint"),
    [
        (["--engine", f"{FAULTS}:Crashing"], 3, "crashed: SIGSEGV"),
        (["--engine", f"{FAULTS}:Raising"], 3, "RuntimeError: no such luck"),
        (["--engine", f"{FAULTS}:Missing"], 3, "its licence server is down"),
        (["--engine", f"{FAULTS}:Diverging"], 1, "body 0 is not finite"),
        (["--engine", f"{FAULTS}:Diverging", "--engine", f"{FAULTS}:Crashing"], 1, "crashed: SIGSEGV"),
        (["--engine", f"{FAKES}:Refusing"], 5, "1 unsupported"),
        (["--engine", f"{FAKES}:Sound", "--only", "rest-heights"], 5, "0 passed"),
        (["--engine", f"{FAKES}:Sound", "--baseline", "none.json"], 4, "baseline accept none.json"),
        (["--engine", f"{FAULTS}:Raising", "--baseline", "none.json"], 3, "baseline accept none.json"),
    ],
    ids=lambda value: " ".join(Path(word).name for word in value) if isinstance(value, list) else None,
)
def test_exit_codes(words: list[str], code: int, hint: str, tmp_path: Path) -> None:
    done = here("check", "equal_masses[bounciness=1]", *words, cwd=tmp_path)
    assert done.returncode == code, done.stdout + done.stderr
    assert hint in done.stdout
    assert "checks: " in done.stdout.splitlines()[-1]
    assert list(tmp_path.iterdir()) == []


MISTAKES = [
    (["--only", "momentun"], "did you mean momentum?"),
    (["--until", "0"], "--until"),
    (["--budgets", "none.toml"], "cannot read none.toml"),
    (["--junit", "no/such/j.xml"], "No such file or directory"),
    (["--summary", "/proc/s.md"], "cannot write"),
    (["--step", "0"], "write it as 1/240"),
]


@pytest.mark.parametrize(("words", "hint"), MISTAKES, ids=[" ".join(words) for words, _ in MISTAKES])
def test_a_mistake_is_one_line_and_nothing_is_run(words: list[str], hint: str, tmp_path: Path) -> None:
    done = here("check", "equal_masses", *words, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert hint in one_line(done)
    assert list(tmp_path.iterdir()) == []


def test_a_baseline_is_accepted_compared_and_never_written_by_a_check(tmp_path: Path) -> None:
    case, sound, dull = "static_wall[bounciness=0.5]", f"{FAKES}:Sound", f"{FAKES}:Dull"
    renamed = tmp_path / "engine.py"
    renamed.write_text(FAKES.read_text() + "\n\nclass Mine(Sound): ...\n")
    mine = f"{renamed}:Mine"
    off = tmp_path / "off.toml"
    off.write_text('[[budget]]\ncheck = "*"\noff = true\nreason = "only the baseline counts here"\n')
    accepted = here("baseline", "accept", "b.json", case, "--engine", mine, "--reason", "first", cwd=tmp_path)
    assert accepted.returncode == 0, accepted.stderr
    file = tmp_path / "b.json"
    before = file.read_bytes()
    check = ["check", case, "--engine", mine, "--baseline", "b.json", "--budgets", "off.toml"]
    assert here(*check, cwd=tmp_path).returncode == 0
    renamed.write_text(FAKES.read_text() + "\n\nclass Mine(Dull): ...\n")
    worse = here(*check, cwd=tmp_path)
    assert worse.returncode == 1
    assert "changed: " in worse.stdout
    assert "energy_drift 0 -> -0.004975" in worse.stdout  # (0.99 * 0.5)^2 - 0.5^2 of the energy
    assert file.read_bytes() == before
    again = here("baseline", "accept", "b.json", case, "--engine", mine, "--reason", "softer", cwd=tmp_path)
    assert again.returncode == 0
    history = json.loads(file.read_text())["history"]
    assert [entry["reason"] for entry in history] == ["first", "softer"]
    assert any(change.endswith("restitution_error 0 -> -0.005") for change in history[1]["changes"])
    other = here("check", case, "--engine", sound, "--baseline", "b.json", cwd=tmp_path)
    assert other.returncode == 4
    file.write_text('{"schema": 1, "cells": [')
    assert here(*check, cwd=tmp_path).returncode == 4
    broken = here("baseline", "accept", "b.json", case, "--engine", dull, "--reason", "x", cwd=tmp_path)
    assert broken.returncode == 2
    assert "is not a baseline" in one_line(broken)
    assert file.read_text() == '{"schema": 1, "cells": ['


def test_what_cannot_be_measured_is_not_accepted(tmp_path: Path) -> None:
    done = here(
        "baseline", "accept", "b.json", "equal_masses[bounciness=1]", "--engine", f"{FAULTS}:Raising", "--reason", "x",
        cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 3
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_one_line_and_keeps_the_earlier_file(tmp_path: Path) -> None:
    """No file may grow beyond 1 kB: to the program a disk that is full."""
    (tmp_path / "j.xml").write_text("precious")
    limit = (1024, resource.getrlimit(resource.RLIMIT_FSIZE)[1])
    words = ["check", "equal_masses[bounciness=1]", "--engine", f"{FAKES}:Sound", "--junit", "j.xml"]
    done = subprocess.run(
        [str(BIN / "impactbench"), *words], capture_output=True, text=True, timeout=60, cwd=tmp_path, env=ENVIRONMENT,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit),
    )  # fmt: skip
    assert done.returncode == 2, done.stdout
    assert "cannot write" in one_line(done)
    assert "checks: " in done.stdout
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("j.xml", "precious")]


def test_an_interrupted_check_exits_130_and_writes_nothing(tmp_path: Path) -> None:
    words = ["check", "equal_masses", "--engine", f"{FAKES}:Slow", "--junit", "j.xml"]
    process = subprocess.Popen(
        [str(BIN / "impactbench"), *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path,
        env=ENVIRONMENT,
    )  # fmt: skip
    time.sleep(2.5)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert errors.strip() == "impactbench: interrupted"
    assert list(tmp_path.iterdir()) == []


def test_repeated_runs_give_identical_verdicts() -> None:
    """Two runs here, of the cases where contacts settle; twenty of the whole selection were measured."""
    words = ["check", "stacked_drop", "rolling_onset", "--engine", "pybullet", "--engine", "mujoco", "--json"]
    runs = [json.loads(here(*words).stdout) for _ in range(2)]
    assert runs[0]["verdicts"] == runs[1]["verdicts"]
    assert len(runs[0]["verdicts"]) > 100


def test_skipped_cells_say_why(tmp_path: Path) -> None:
    done = here("check", "torque_free_spin", "--engine", "pymunk", "--junit", "j.xml", cwd=tmp_path)
    assert done.returncode == 5
    suite = next(iter(JUnitXml.fromfile(str(tmp_path / "j.xml"))))
    (case,) = list(suite)
    assert isinstance(case.result[0], Skipped)
    assert "unsupported: " in case.result[0].message


@pytest.mark.parametrize(
    ("schema", "file"),
    [
        ("vendor.github-workflows", ".github/workflows/check.yml"),
        ("vendor.github-actions", ".github/actions/check/action.yml"),
    ],
)
def test_workflow_files_are_valid(schema: str, file: str) -> None:
    command = [str(BIN / "check-jsonschema"), "--builtin-schema", schema, str(HERE.parent / file)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_the_actions_script_keeps_the_exit_code_and_the_outputs(tmp_path: Path) -> None:
    """The composite action's own script, run by bash as the service does."""
    text = (HERE.parent / ".github" / "actions" / "check" / "action.yml").read_text()
    body = text.partition("run: |\n")[2].partition("    - name: Keep the report")[0]
    script = "\n".join(line[8:] for line in body.splitlines())
    inputs = {"CASES": "equal_masses[bounciness=1]", "ENGINES": f"{FAKES}:Dull", "PROFILE": "tuned", "STEP": "1/240"}
    files = {"OUT": "out", "BUDGETS": "", "BASELINE": "", "GITHUB_OUTPUT": "output", "GITHUB_STEP_SUMMARY": "summary"}
    done = subprocess.run(
        ["bash", "-e", "-o", "pipefail", "-c", script], env=ENVIRONMENT | inputs | files, cwd=tmp_path,
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 1, done.stderr
    assert (tmp_path / "output").read_text() == "exit-code=1\n"
    assert "impactbench check: failed" in (tmp_path / "summary").read_text()
    assert {"report.html", "results.json", "junit.xml", "summary.md", "failures.sh"} <= {
        path.name for path in (tmp_path / "out").iterdir()
    }
