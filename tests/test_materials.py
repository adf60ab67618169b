"""Bounciness of pairs from materials (documents, rule R10), from the scene file to the motion."""

from __future__ import annotations

import math

import pytest
from impactbench.adapters.contestants import select
from impactbench.scenarios.scene_file import read_case
from impactbench.scenarios.scene_values import SceneError

TEXT = """
duration = 0.5
{mixing}
[contact]
bounciness = 1.0
[[bodies]]
name = "ball"
shape = "sphere"
radius = 0.1
mass = 1.0
position = [0, 0, 0.35]
velocity = [0, 0, -1]
bounciness = 0.9
[[statics]]
name = "floor"
shape = "plane"
position = [0, 0, 0]
normal = [0, 0, 1]
{floor}
"""


def case_of(folder, mixing="", floor="bounciness = 0.4"):
    path = folder / "drop.toml"
    path.write_text(TEXT.format(mixing=mixing, floor=floor))
    return read_case(str(path))


EXPECTED = {
    "average": 0.65,
    "minimum": 0.4,
    "maximum": 0.9,
    "product": 0.36,
    "geometric mean": math.sqrt(0.36),
}


@pytest.mark.parametrize("mixing", EXPECTED)
@pytest.mark.parametrize("name", ["reference/stepped", "pymunk/tuned"])
def test_the_ball_leaves_with_the_mixed_bounciness(tmp_path, mixing, name):
    scene = case_of(tmp_path, f'mixing = "{mixing}"').scene
    assert scene.contact_of(0, 1).bounciness == pytest.approx(EXPECTED[mixing], rel=1e-15)
    (contestant,) = select([name])
    engine = contestant.load()(scene, contestant.law, contestant.profile, scene.model, 1 / 240)
    engine.advance(110)
    assert engine.read().velocities[0, 2] == pytest.approx(EXPECTED[mixing], rel=1e-9)
    engine.close()


def test_average_is_the_default_and_a_body_without_a_material_has_the_scenes(tmp_path):
    assert case_of(tmp_path).scene.contact_of(0, 1).bounciness == pytest.approx(0.65)
    assert case_of(tmp_path, floor="").scene.contact_of(0, 1).bounciness == pytest.approx(0.95)


def test_a_listed_pair_wins(tmp_path):
    listed = 'bounciness = 0.4\n[[pairs]]\nbetween = ["ball", "floor"]\nbounciness = 0.1'
    assert case_of(tmp_path, floor=listed).scene.contact_of(0, 1).bounciness == 0.1


def test_bad_values_are_one_line_with_line_and_key(tmp_path):
    with pytest.raises(SceneError, match=r"drop.toml:3: mixing: unknown mixing .*minimum"):
        case_of(tmp_path, 'mixing = "minimal"')
    with pytest.raises(SceneError, match=r"statics\[0\].bounciness: must be between 0 and 1, got 1.4"):
        case_of(tmp_path, floor="bounciness = 1.4")
