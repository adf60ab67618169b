"""The engine contract: kept by the engines, and every point of it seen to fail."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest
from impactbench.adapters.contestants import Contestant, UnknownContestant, installed, select
from impactbench.adapters.pair_probe import BOUNCE
from impactbench.reports.conform import FAIL, POINTS, UNTRIED, Verdict, conform, exit_code, lines
from impactbench.reports.pair_laws import LAWS, law_of_pair, measured_laws

ROOT = Path(__file__).parent.parent
FAKES = ROOT / "tests" / "fakes" / "contract.py"
EXAMPLE = ROOT / "docs" / "example_engine.py"
COMMAND = str(Path(sys.executable).parent / "impactbench")

BROKEN = {
    "FourArguments": ("constructor", "too many positional arguments"),
    "NoClose": ("methods", "no close"),
    "NotImplementedForWalls": ("unsupported", "NotImplementedError: walls for static_wall"),
    "NoReason": ("unsupported", "without a reason"),
    "ArraySetting": ("settings", "'gravity' that JSON cannot hold"),
    "NanSetting": ("settings", "'tolerance' that JSON cannot hold"),
    "NoSettings": ("settings", "NoneType, no mapping"),
    "SinglePrecision": ("arrays", "positions of type float32"),
    "Transposed": ("arrays", "velocities of shape [3, 1]"),
    "WithStatics": ("statics", "2 rows for 1 movable bodies of 2"),
    "Backwards": ("initial state", "the rows in another order"),
    "HalfAStepAhead": ("initial state", "positions off by"),
    "Exposed": ("mutation", "after its arrays were written to"),
    "OneBuffer": ("earlier reads", "an earlier read that changed"),
    "OneStepShort": ("advance", "apart after 60 steps"),
    "Damped": ("free flight", "order 0"),
    "Drifting": ("fresh builds", "apart after 60 steps"),
    "OneWorld": ("two at once", "apart after 60 steps"),
    "AlwaysSpins": ("spins", "given without rotation modelled"),
    "NeverSpins": ("spins", "rotation modelled but not both"),
}
"""Fake -> the one point it breaks, and words of what is found."""


class OneLane(Contestant):
    """Fakes share children, which saves starting one for each."""

    @property
    def lane(self) -> str:
        return "fakes"


def fakes(*names: str) -> list[Contestant]:
    return [OneLane(name, "default", f"{FAKES}:{name}") for name in names]


@pytest.fixture(scope="module")
def verdicts() -> dict[str, list[Verdict]]:
    found = conform(fakes("Faithful", "Refusing", *BROKEN), 2)
    return {name.partition("/")[0]: row for name, row in found.items()}


def test_a_faithful_engine_keeps_every_point(verdicts: dict[str, list[Verdict]]) -> None:
    assert [v for v in verdicts["Faithful"] if v.state != "pass"] == []
    assert exit_code({"Faithful": verdicts["Faithful"]}) == 0


@pytest.mark.parametrize("fake", BROKEN)
def test_a_fault_fails_its_own_point_and_no_other(verdicts: dict[str, list[Verdict]], fake: str) -> None:
    point, words = BROKEN[fake]
    failed = {v.point: v.found for v in verdicts[fake] if v.state == FAIL}
    assert list(failed) == [point]
    assert words in failed[point]
    untried = {v.point for v in verdicts[fake] if v.state == UNTRIED}
    assert untried <= {name for name in POINTS if set(POINTS[name].needs) & {point, "initial state"}}
    assert exit_code({fake: verdicts[fake]}) == 1


def test_every_point_is_seen_to_fail() -> None:
    assert {point for point, _ in BROKEN.values()} == set(POINTS)


def test_an_engine_that_builds_nothing_was_not_run(verdicts: dict[str, list[Verdict]]) -> None:
    assert {v.state for v in verdicts["Refusing"]} == {"pass", UNTRIED}
    assert exit_code({"Refusing": verdicts["Refusing"]}) == 3


def test_an_engine_that_kills_its_process_fails_the_point_that_did_it() -> None:
    found = conform(fakes("Dying"), 1)
    assert [(v.point, v.found) for v in found["Dying/default"] if v.state != "pass"] == [
        ("advance", "crashed: SIGABRT")
    ]


@pytest.fixture(scope="module")
def of_engines() -> dict[str, list[Verdict]]:
    return conform(select(["mujoco", "pymunk", "pybullet"]), 2)


@pytest.mark.parametrize("name", ["mujoco/default", "mujoco/tuned", "pymunk/default", "pymunk/tuned"])
def test_mujoco_and_pymunk_keep_every_point(of_engines: dict[str, list[Verdict]], name: str) -> None:
    assert [v for v in of_engines[name] if v.state != "pass"] == []


@pytest.mark.skipif(bool(select(["pybullet/tuned"])[0].availability()), reason="no pybullet here")
@pytest.mark.parametrize(
    ("profile", "known"),
    [
        ("tuned", {"two at once"}),  # the adapter keeps one client for the process: a second world resets the first
        ("default", {"two at once", "free flight"}),  # the vendor's damping slows free flight at every step
    ],
)
def test_pybullet_keeps_the_points_but_known_ones(
    of_engines: dict[str, list[Verdict]], profile: str, known: set[str]
) -> None:
    assert {v.point for v in of_engines[f"pybullet/{profile}"] if v.state != "pass"} <= known


def impactbench(*words: str, path: Path | None = None) -> subprocess.CompletedProcess[str]:
    env = os.environ | ({"PYTHONPATH": str(path)} if path else {})
    return subprocess.run([COMMAND, *words], capture_output=True, text=True, check=False, timeout=60, env=env)


def test_the_example_conforms_and_fits_a_page() -> None:
    done = impactbench("conform", f"{EXAMPLE}:Example")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("Example/default: 14 of 14 points hold")
    assert len(done.stdout.splitlines()) == 1 + len(POINTS)
    assert len(EXAMPLE.read_text(encoding="utf-8").splitlines()) <= 60


def test_exit_codes_of_a_failure_a_mistake_and_an_absent_engine() -> None:
    failed = impactbench("conform", f"{FAKES}:OneStepShort")
    assert failed.returncode == 1
    assert "FAIL       advance" in failed.stdout
    mistake = impactbench("conform", "mujocco")
    assert mistake.returncode == 2
    assert len(mistake.stderr.splitlines()) == 1
    absent = impactbench("conform", f"{FAKES}:Nobody")
    assert absent.returncode == 3
    assert "unavailable" in absent.stdout


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """A folder with a package installed in it that offers an engine, and one that takes a name of ours."""
    (tmp_path / "toy.py").write_text(EXAMPLE.read_text(encoding="utf-8"), encoding="utf-8")
    folder = tmp_path / "toy_engine-2.5.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: toy-engine\nVersion: 2.5\n")
    (folder / "entry_points.txt").write_text("[impactbench.engines]\ntoy = toy:Example\nmujoco = toy:Example\n")
    return tmp_path


def test_an_installed_engine_takes_part_when_asked_for(site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(site)
    assert [(c.name, c.factory, c.version()) for c in installed()] == [("toy/default", "toy:Example", "2.5")]
    assert "toy" not in {c.engine for c in (*select(), *select(["*"]), *select(profiles=["default"]))}
    assert [c.name for c in select(["toy"], ["tuned"])] == [c.name for c in select(["toy/default"])] == ["toy/default"]
    assert {c.distribution for c in select(["mujoco"])} == {"mujoco"}
    with pytest.raises(UnknownContestant, match="did you mean toy"):
        select(["tooy"])


def test_an_installed_engine_is_listed_and_conforms(site: Path) -> None:
    listed = impactbench("list", "engines", path=site)
    assert re.search(r"^toy/default +2\.5 +installed; ", listed.stdout, re.M)
    done = impactbench("conform", "toy", path=site)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("toy/default: 14 of 14")


def test_pair_laws_are_what_the_engines_do() -> None:
    begun = time.monotonic()
    rows = {row[0]: row[1:] for row in measured_laws()}
    assert rows["pybullet"] == rows["pymunk"] == ("product (0.4000)", "product (0.4000)", "product (0.1200)")
    assert rows["mujoco"] == ("none", "none", "maximum (0.6000)")
    assert all("pairs" in cell for cell in rows["reference"])
    assert time.monotonic() - begun < 10


@pytest.mark.parametrize("name", LAWS)
def test_a_law_is_recognised_by_its_number(name: str) -> None:
    value = LAWS[name](*BOUNCE)
    assert law_of_pair((value, value), BOUNCE) == f"{name} ({value:.4f})"


def test_a_law_that_is_none_of_them_is_not_named() -> None:
    assert law_of_pair((0.45, 0.45), BOUNCE) == "no law known (0.4500)"
    assert law_of_pair((0.5, 0.8), BOUNCE) == "depends on the order (0.5000, 0.8000)"
    assert law_of_pair(None, BOUNCE) == "none"


def test_every_line_says_what_was_expected_and_found(verdicts: dict[str, list[Verdict]]) -> None:
    head, *rest = lines({"x": verdicts["Damped"]})
    assert head == "x: 13 of 14 points hold, 1 fail, 0 not tried"
    assert all("expected: " in line and "; found: " in line for line in rest)
