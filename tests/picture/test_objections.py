"""The picture judged before the drives are armed: refused with the ring or the frame that disagrees."""

from __future__ import annotations

import numpy as np
import pytest

from support import pictures
from support.pictures import RINGS, STILL, exchanged, frames, labels_moved, mirrored, shifted, turned
from tcrctl.picture.objections import objections
from tcrctl.picture.settings import PictureSettings
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.module import ring_rows


def against(distort=lambda m: m, seed=1, at=0, **made):
    """Objections to frames of the robot, at rest or as it stands in a frame of the film."""
    film = frames(seed, **made)
    shown = film[:STILL] if at == 0 else film[at : at + STILL]
    return objections(PictureSettings(), pictures.robot(), [distort(m) for m in shown])


@pytest.mark.slow
@pytest.mark.parametrize("at", [0, 200, 350, 470])
@pytest.mark.parametrize(
    ("seed", "made"),
    [(1, {}), (2, {"bias_mm": 4.0}), (3, {"bias_mm": 4.0, "lost": 0.2}), (4, {"bias_mm": 0.0})],
)
def test_a_healthy_robot_is_accepted_wherever_it_stands(seed, made, at):
    assert against(seed=seed, at=at, **made) == []


@pytest.mark.slow
@pytest.mark.parametrize("way", [(1.0, 0.0), (-0.6, 0.8)])
def test_a_robot_that_hangs_far_beside_its_model_is_accepted(way):
    """Real robots hang up to 61 mm aside."""
    robot = pictures.robot()
    push = robot.weight.copy()
    push[3 * robot.tip : 3 * robot.tip + 2] += 0.085 * np.array(way)
    q = equilibrium(robot.model, np.zeros(3), push, robot.rest.q).q
    aside = q.reshape(-1, 3)[ring_rows(RINGS)]
    assert 0.05 < np.linalg.norm((aside - robot.rest.q.reshape(-1, 3)[ring_rows(RINGS)])[-1]) < 0.08
    assert against(lambda m: pictures.moved(m, aside + (m.nodes - frames(1)[0].nodes))) == []


FRAMES = {
    "turned by 20 deg": (lambda m: turned(m, 0, 0, 20), "turned about the vertical by 20 deg"),
    "turned by 90 deg": (lambda m: turned(m, 0, 0, 90), "turned about the vertical by 90 deg"),
    "turned by -15 deg": (lambda m: turned(m, 0, 0, -15), "turned about the vertical by 15 deg"),
    "turned by 180 deg": (lambda m: turned(m, 0, 0, 180), "turned about the vertical by 1"),
    "tilted by 20 deg": (lambda m: turned(m, 0, 20, 0), "tilted by"),
    "tilted by 13 deg": (lambda m: turned(m, -9.2, 9.2, 0), "tilted by"),
    "upside down": (lambda m: turned(m, 0, 180, 0), "tilted by 1"),
    "lying": (lambda m: turned(m, 90, 0, 0), "tilted by"),
    "10 mm aside": (
        lambda m: shifted(m, slice(None), (10, 0, 0)),
        "the frame of the cameras is not believed",
    ),
    "17 mm too high": (
        lambda m: shifted(m, slice(None), (0, 0, 17)),
        "the frame of the cameras is not believed",
    ),
    "mirrored in x": (lambda m: mirrored(m, 0), "mirrored"),
    "mirrored in y": (lambda m: mirrored(m, 1), "mirrored"),
    "mirrored in z": (lambda m: mirrored(m, 2), "mirrored"),
    "in other units": (lambda m: pictures.moved(m, 1.3 * m.nodes), "sides of ring"),
    "in inches": (lambda m: pictures.moved(m, 0.0254 * m.nodes), "sides of ring"),
}


@pytest.mark.slow
@pytest.mark.parametrize("at", [0, 350])
@pytest.mark.parametrize("name", FRAMES)
def test_a_wrong_frame_is_named(name, at):
    distort, says = FRAMES[name]
    told = against(distort, at=at, bias_mm=1.0)
    assert any(says in text for text in told), told


@pytest.mark.slow
@pytest.mark.parametrize(("first", "second"), [(4, 7), (1, 2), (10, 11), (1, 11), (6, 7)])
def test_swapped_rings_are_named(first, second):
    told = against(lambda m: exchanged(m, first, second))
    assert f"ring {first} is seen where ring {second} should be: are their labels exchanged?" in told
    assert f"ring {second} is seen where ring {first} should be: are their labels exchanged?" in told


@pytest.mark.parametrize(("ring", "by"), [(5, 1), (1, 1), (RINGS, 2), (3, 2)])
def test_turned_labels_are_named(ring, by):
    told = against(lambda m: labels_moved(m, ring, by), at=200)
    assert any(text.startswith(f"the labels of ring {ring} are turned by ") for text in told)
    assert not any(
        f"labels of ring {other} are" in text
        for other in range(1, RINGS + 1)
        if other != ring
        for text in told
    )


def test_two_exchanged_labels_of_a_ring_are_named():
    order = np.arange(3 * RINGS)
    order[[12, 13]] = [13, 12]
    told = against(lambda m: pictures.relabelled(m, order))
    assert any("ring 5" in text for text in told)


@pytest.mark.parametrize(("one", "other"), [(3, 30), (0, 4), (14, 15)])
def test_exchanged_labels_of_two_rings_are_named(one, other):
    order = np.arange(3 * RINGS)
    order[[one, other]] = [other, one]
    told = against(lambda m: pictures.relabelled(m, order))
    for row in (one, other):
        assert any(f"m{row // 3 + 1}.n" in text or f"ring {row // 3 + 1} " in text for text in told)


def test_far_rings_without_neighbours_are_named():
    some = np.zeros(3 * RINGS, np.bool_)
    some[pictures.rows_of(2) + pictures.rows_of(6) + pictures.rows_of(RINGS)] = True

    def sparse(m):
        return pictures.moved(m, m.nodes, m.valid & some)

    assert against(sparse) == []
    assert against(lambda m: sparse(exchanged(m, 2, RINGS))) != []


def test_nothing_seen_is_no_picture_to_object_to():
    nobody = np.zeros(3 * RINGS, np.bool_)
    assert against(lambda m: pictures.moved(m, m.nodes, nobody)) == []
