"""The table: what a filter selects, and what is said when it selects nothing or the engine is missing."""

import pickle
import subprocess
import sys
from pathlib import Path

import pytest
from impactbench.adapters.contestants import CONTESTANTS, Contestant, UnknownContestant, _why_missing, select
from impactbench.scenarios.engine import Unavailable


def names(*engines: str, profiles: tuple[str, ...] = ()) -> list[str]:
    return [contestant.name for contestant in select(engines, profiles)]


def test_filters():
    assert select() == CONTESTANTS
    assert names("mujoco") == ["mujoco/default", "mujoco/tuned"]
    assert names("pymunk/tuned", "mujoco/tuned", "mujoco/t*") == ["mujoco/tuned", "pymunk/tuned"]
    assert names("py*", profiles=("default",)) == ["pybullet/default", "pymunk/default"]
    assert names("reference") == ["reference/stepped", "reference/exact"]
    assert {c.law for c in select(["reference"])} == {"doc"}
    assert {c.law for c in select(profiles=["default", "tuned"])} == {"nc"}


@pytest.mark.parametrize(
    ("engines", "profiles", "message"),
    [
        (
            ["mujco"],
            [],
            "unknown contestant 'mujco'; did you mean mujoco\\? known: reference, pybullet, .*pymunk/tuned",
        ),
        (["zzz"], [], "unknown contestant 'zzz'; known: reference"),
        ([], ["tunned"], "unknown profile 'tunned'; did you mean tuned\\? known: stepped, exact, default, tuned"),
        (["reference"], ["tuned"], "no contestant is both reference and tuned"),
        (["absent.py:Fake"], [], "'absent.py:Fake': no such file"),
        (["a:Fake", "b:Fake"], [], "a:Fake and b:Fake are both named Fake/default"),
        (["a:"], [], "not of the form"),
    ],
)
def test_a_filter_that_selects_nothing_says_what_there_is(engines, profiles, message):
    with pytest.raises(UnknownContestant, match=message) as caught:
        select(engines, profiles)
    assert "\n" not in str(caught.value)


def test_own_engine_from_a_file(tmp_path: Path):
    path = tmp_path / "own_engine.py"
    path.write_text("class Fake:\n    settings = {'own': 1}\n")
    (own,) = select([f"{path}:Fake"], ["tuned"])
    assert (own.name, own.version(), own.availability(), own.law) == ("Fake/default", None, "", "nc")
    assert pickle.loads(pickle.dumps(own)).load().settings == {"own": 1}
    with pytest.raises(Unavailable, match=r"Other/default cannot be loaded: .*Other"):
        select([f"{path}:Other"])[0].load()


def test_a_missing_engine_says_why():
    ghost = Contestant("ghost", "default", "ghost_engine:Ghost", "no-such-distribution")
    assert ghost.version() is None
    assert ghost.availability() == "no-such-distribution is not installed"
    with pytest.raises(Unavailable, match="no-such-distribution is not installed"):
        ghost.load()
    wheel = "no pybullet wheel for Python 3.13 on linux x86_64"
    assert _why_missing("pybullet", (3, 13), "linux", "x86_64") == wheel
    assert _why_missing("pybullet", (3, 11), "darwin", "arm64").endswith("on darwin arm64")
    assert _why_missing("pybullet", (3, 11), "linux", "x86_64") == "pybullet is not installed"


def test_asking_imports_no_engine():
    program = """
import sys
from impactbench.adapters.contestants import select
for contestant in select():
    contestant.version(), contestant.availability()
print(sorted({"pybullet", "mujoco", "pymunk", "numba"} & set(sys.modules)))
"""
    assert subprocess.check_output([sys.executable, "-c", program], text=True) == "[]\n"
