"""Robot files: what they mean in SI units, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from tcrctl.config import shipped, strict_yaml
from tcrctl.errors import InputError, SpecError, UnknownNameError
from tcrctl.robot.description import RobotDescription, cable_routes, load_robot, spring_list

ROBOTS = sorted(shipped.robots())


def changed(*overrides: str, robot: str = "tcr700") -> RobotDescription:
    return load_robot(robot, overrides=overrides)


def problems_of(*overrides: str) -> str:
    with pytest.raises(SpecError) as caught:
        changed(*overrides)
    return str(caught.value)


@pytest.mark.parametrize("name", ROBOTS)
def test_shipped_robots_are_valid_and_survive_both_file_formats(name: str) -> None:
    robot = load_robot(name)
    assert robot.name == name
    assert RobotDescription.model_validate_json(robot.model_dump_json()) == robot
    text = strict_yaml.dumps(robot.model_dump(mode="json"))
    assert strict_yaml.validate(strict_yaml.loads(text), RobotDescription) == robot


@pytest.mark.parametrize(
    ("name", "modules", "cables"), [("tcr600", 11, 3), ("tcr700", 13, 6), ("tcr5x4", 5, 4)]
)
def test_a_robot_has_three_springs_per_joint_and_one_hole_per_ring_that_a_cable_passes(
    name: str, modules: int, cables: int
) -> None:
    robot = load_robot(name)
    assert len(spring_list(robot)) == 3 * modules
    routes = cable_routes(robot)
    assert len(routes) == cables
    for route in routes:
        assert [ring for ring, _ in route.holes] == list(range(len(route.holes)))
    assert max(len(route.holes) for route in routes) == modules + 1


def test_the_two_segment_robot_is_700_mm_long_and_its_joints_are_self_stressed() -> None:
    modules = load_robot("tcr700").modules
    assert modules.count * modules.pitch_mm + modules.cone_height_mm == pytest.approx(700, abs=0.1)
    assert modules.cone_height_mm - modules.pitch_mm == pytest.approx(6.27)


def test_holes_of_the_two_segment_robot_are_60_degrees_apart_and_alternate_in_length() -> None:
    routes = cable_routes(load_robot("tcr700"))
    angles = [math.degrees(route.holes[0][1]) for route in routes]
    assert angles == pytest.approx([0, 60, 120, 180, 240, 300])
    assert [route.holes[-1][0] for route in routes] == [13, 8, 13, 8, 13, 8]


def test_units_of_the_file_become_si() -> None:
    robot = load_robot("tcr700")
    spring, cable = spring_list(robot)[0], cable_routes(robot)[0]
    section = math.pi / 4 * 0.0008**2
    assert spring.nodes == ("base.apex", "m1.n1")
    assert spring.axial_stiffness == pytest.approx(90e6 * section)
    assert (spring.natural_length, spring.mass) == pytest.approx((0.018, 0.0008))
    assert cable.axial_stiffness == pytest.approx(2300e6 * section)
    assert (cable.lead, cable.initial_tension, cable.rest_length) == (0.1, 5.0, None)


def test_a_joint_is_repeated_from_the_base_down() -> None:
    nodes = [spring.nodes for spring in spring_list(load_robot("tcr5x4"))]
    assert nodes[3] == ("m1.apex", "m2.n1")
    assert nodes[-1] == ("m4.apex", "m5.n3")


def test_a_further_spring_takes_from_the_common_values_what_it_does_not_say() -> None:
    robot = changed(
        "springs.between=[[base.n1, m3.apex], {nodes: [m1.n1, m2.n2], mass_g: 0, natural_length_mm: 30}]"
    )
    plain, special = spring_list(robot)[-2:]
    common = spring_list(robot)[0]
    assert plain.nodes == ("base.n1", "m3.apex")
    assert (plain.mass, plain.natural_length) == (common.mass, common.natural_length)
    assert (special.mass, special.natural_length) == (0.0, 0.03)
    assert special.axial_stiffness == common.axial_stiffness


def test_a_cable_may_run_through_any_holes_in_any_order() -> None:
    holes = "[{ring: 0, hole_deg: 0}, {ring: 5, hole_deg: 90}, {ring: 2, hole_deg: -45}]"
    robot = changed(f"cables.routes=[{{name: x, through: {holes}, initial_tension_n: 7}}]")
    (route,) = cable_routes(robot)
    assert [ring for ring, _ in route.holes] == [0, 5, 2]
    assert [math.degrees(angle) for _, angle in route.holes] == pytest.approx([0, 90, -45])
    assert route.initial_tension == 7


def test_rest_lengths_may_replace_the_initial_tension() -> None:
    a = "{name: a, hole_deg: 0, to_ring: 3, rest_length_mm: 248}"
    b = "{name: b, hole_deg: 9, to_ring: 3, rest_length_mm: 250}"
    robot = changed("cables.initial_tension_n=null", f"cables.routes=[{a}, {b}]")
    assert [(r.rest_length, r.initial_tension) for r in cable_routes(robot)] == [(0.248, None), (0.25, None)]


def through(*holes: tuple[int, float]) -> str:
    """Return an override that leads the first cable through holes (ring, angle in degrees)."""
    listed = ", ".join(f"{{ring: {ring}, hole_deg: {angle}}}" for ring, angle in holes)
    return f"cables.routes.0={{name: x, through: [{listed}]}}"


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("modules.count=0", "must be >= 1"),
        ("modules.pitch_mm=0", "must be > 0"),
        ("modules.ring_mass_fraction=1", "must be < 1"),
        ("modules.youngs_modulus_mpa=-1", "must be > 0"),
        ("springs.tension_only=1", "must be true or false"),
        ("springs.joint=[[upper.n4, lower.n1]]", "upper.n4"),
        ("springs.joint=[[upper.n1, lower.n1], [lower.n1, upper.n1]]", "joined already"),
        ("springs.between=[[m14.apex, base.n1]]", "there is no node m14.apex; modules are base, m1 to m13"),
        ("springs.between=[[m1.apex, m1.apex]]", "with itself"),
        ("springs.between=[{nodes: [m1.n1, m2.n1], masss_g: 1}]", "did you mean mass_g?"),
        ("cables.routes=[]", "at least 1 entries"),
        ("cables.routes.0.to_ring=14", "there is no ring 14; rings are 0 (base) to 13"),
        ("cables.routes.1.name=c1", "used 2 times"),
        ("cables.routes.0.hole_deg=400", "must be <= 360"),
        (through((0, 0)), "at least 2 entries"),
        (through((1, 0), (2, 0)), "begins at ring 0"),
        (through((0, 0), (0, 0)), "the same hole"),
        (through((0, 0), (20, 0)), "no ring 20"),
        ("cables.routes.0.rest_length_mm=700", "not both"),
        ("cables.initial_tension_n=null", "needs initial_tension_n or rest_length_mm"),
        ("cables.initial_tension_n=200", "above tension_limit_n"),
        ("tip.ring=14", "there is no ring 14"),
        ("stroke_mm=[200, -100]", "with 0 in between"),
        ("gravity_m_s2=[0, 0]", "too short"),
        ("name=a/b", "must match"),
        ("modules.mass_kg=1", "unknown key"),
    ],
)
def test_robots_that_cannot_be_built_are_refused(override: str, words: str) -> None:
    message = problems_of(override)
    assert words in message
    assert "tcr700.yaml:" in message or f"--set {override.split('=')[0]}" in message


def test_all_disagreements_are_listed_at_once() -> None:
    message = problems_of("tip.ring=14", "stroke_mm=[1, 2]", "cables.routes.2.to_ring=99")
    assert [line.split(":")[0] for line in message.splitlines()] == [
        "--set cables.routes.2.to_ring",
        "--set tip.ring",
        "--set stroke_mm",
    ]


def test_robots_are_found_by_name_and_by_path(tmp_path: Path) -> None:
    copy = tmp_path / "mine.yaml"
    copy.write_bytes(shipped.robots()["tcr5x4"].read_bytes())
    assert load_robot(str(copy)) == load_robot("./mine.yaml", tmp_path) == load_robot("tcr5x4")
    with pytest.raises(UnknownNameError) as caught:
        load_robot("tcr60")
    assert caught.value.allowed == tuple(ROBOTS)
    assert "tcr600" in caught.value.hint
    with pytest.raises(InputError, match="no such file"):
        load_robot("./nothing.yaml", tmp_path)
