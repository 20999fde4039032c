"""The robot of a simulated plant: another file, differences, other strings, and how much that shows."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.errors import NoEquilibriumError, SpecError
from tcrctl.experiment.plant_robot import merged
from tcrctl.experiment.spec import load_spec
from tcrctl.plant.own_robot import friction_of, moving_robot, own_description
from tcrctl.plant.settings import SimulatedSettings
from tcrctl.robot.description import load_robot, spring_list
from tcrctl.robot.robot import build_robot

SPEC = """\
name: standing
robot: tcr700
trajectory: {kind: hold, duration_s: 1}
controller: {kind: ioc}
plant: {kind: simulated}
"""


def plant(**settings):
    return SimulatedSettings(kind="simulated", **settings)


def loaded(folder, *overrides):
    path = folder / "standing.yaml"
    path.write_text(SPEC)
    return load_spec(str(path), overrides)


def problems_of(folder, *overrides):
    with pytest.raises(SpecError) as caught:
        loaded(folder, *overrides)
    return str(caught.value)


def test_without_a_robot_of_its_own_a_plant_moves_that_of_the_controller(tmp_path, tcr5x4):
    assert loaded(tmp_path).plant_robot is None
    assert moving_robot(plant(), tcr5x4) is tcr5x4


def test_differences_are_put_into_the_file_of_the_controllers_robot(tmp_path):
    found = loaded(tmp_path, "plant.robot={springs: {youngs_modulus_mpa: 45}, tip: {ring: 13}}")
    own, known = found.plant_robot, found.robot
    assert spring_list(own)[0].axial_stiffness == pytest.approx(spring_list(known)[0].axial_stiffness / 2.0)
    assert own.modules == known.modules
    one_by_one = loaded(tmp_path, "plant.robot.springs.youngs_modulus_mpa=45")
    assert one_by_one.plant_robot == own


def test_another_file_is_looked_for_beside_the_experiment(tmp_path):
    (tmp_path / "mine.yaml").write_text(
        "\n".join(
            line.replace("mass_g: 10", "mass_g: 11")
            for line in (load_spec("helix").robot_path).read_text().splitlines()
        )
    )
    path = tmp_path / "standing.yaml"
    path.write_text(SPEC.replace("kind: simulated", "kind: simulated, robot: mine.yaml"))
    assert load_spec(str(path)).plant_robot.modules.mass_g == 11.0


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("plant.robot=tcr600", "has 11 modules; tcr700 has 13"),
        ("plant.robot=tcr600", "has cables c1, c2, c3; tcr700 has c1, c2, c3, c4, c5, c6"),
        ("plant.robot=tcr70", "tcr70"),
        (
            "plant.robot={springs: {youngs_modulus_mpa: -1}}",
            "plant.robot.springs.youngs_modulus_mpa: must be > 0",
        ),
        ("plant.robot.sprigs.youngs_modulus_mpa=1", "unknown key; did you mean springs?"),
        ("plant.robot={tip: {ring: 12}}", "has its tip at ring 12; tcr700 at ring 13"),
        ("plant.robot=[1]", "must be"),
        (
            "plant.cables.initial_tension=[1, 1]",
            "tcr700 has 6 cables, c1, c2, c3, c4, c5, c6; there are 2 values",
        ),
        ("plant.drives.zero_error_mm=[1, 1]", "there are 2 values"),
        ("plant.friction.coefficient=[0.1, 0.1, 0.1]", "there are 3 values"),
        ("plant.drives.radius_error=0.5", "must be < 0.5"),
        ("plant.scatter.springs=2", "must be <= 1"),
        ("plant.cameras.outliers.share=-1", "must be >= 0"),
        ("plant.realistic=modrate", "did you mean moderate?"),
    ],
)
def test_what_does_not_fit_is_refused_where_it_stands(tmp_path, override, words):
    said = problems_of(tmp_path, override)
    assert words in said
    assert f"--set {override.partition('=')[0]}" in said


def test_maps_are_merged_key_by_key_and_everything_else_as_a_whole():
    base = {"a": {"b": 1, "c": [1, 2]}, "d": 3}
    assert merged(base, {"a": {"c": [5]}, "e": 4}) == {"a": {"b": 1, "c": [5]}, "d": 3, "e": 4}
    assert base == {"a": {"b": 1, "c": [1, 2]}, "d": 3}


@pytest.mark.parametrize("factor", [0.85, 1.2])
def test_every_cable_starts_with_its_tension_times_the_factor(tcr5x4, factor):
    moved = moving_robot(plant(cables={"initial_tension": factor}), tcr5x4)
    np.testing.assert_allclose(moved.rest.tension, factor * tcr5x4.rest.tension, rtol=1e-5)
    change = moved.model.cables[:, 0] - tcr5x4.model.cables[:, 0]
    assert np.all(np.sign(change) == np.sign(1.0 - factor))
    mixed = plant(cables={"initial_tension": factor}, mismatch={"springs_youngs_modulus": 0.7})
    soft = moving_robot(plant(mismatch={"springs_youngs_modulus": 0.7}), tcr5x4)
    np.testing.assert_allclose(
        moving_robot(mixed, tcr5x4).rest.tension, factor * soft.rest.tension, rtol=1e-5
    )


def test_factors_of_one_change_no_bit(tcr5x4):
    assert moving_robot(plant(cables={"initial_tension": (1.0,) * 4}), tcr5x4) is tcr5x4


def test_tensions_that_no_shape_has_are_refused(tcr700):
    with pytest.raises(NoEquilibriumError):
        moving_robot(plant(cables={"initial_tension": (0.3, 1.0, 2.0, 1.0, 0.3, 2.0)}), tcr700)


def test_friction_is_that_of_the_robot_unless_the_plant_has_its_own(tcr5x4):
    rough = build_robot(load_robot("tcr5x4", overrides=("friction={coefficient: 0.2}",)))
    assert friction_of(plant(), tcr5x4) is None
    assert friction_of(plant(), rough)[:, 0].tolist() == [0.2] * 24
    assert friction_of(plant(friction={"coefficient": 0.05}), rough)[:, 0].tolist() == [0.05] * 24


def test_a_scattered_robot_hangs_somewhere_else_with_the_rest_lengths_of_the_design(tcr5x4):
    settings = plant(scatter={"springs": 0.1, "geometry_mm": 0.5, "holes_deg": 1.0})
    own = build_robot(own_description(settings, load_robot("tcr5x4"), tcr5x4, 1))
    np.testing.assert_allclose(own.model.cables[:, 0], tcr5x4.model.cables[:, 0], rtol=1e-12)
    assert 5e-4 < np.linalg.norm(own.rest_position - tcr5x4.rest_position) < 0.03
