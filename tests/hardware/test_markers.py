"""From a frame to the robot's nodes: every node in its row, or not there; and where the robot hangs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from support import natnet_wire as wire
from support.natnet_wire import Wire
from tcr_hardware.calibration import CalibrationError, average, calibrate
from tcr_hardware.markers import Gate, MarkerMap, MarkerMapError, NodeMarker, SharedMarkerError
from tcr_hardware.natnet.frame_decoder import decode_frame
from tcr_hardware.natnet.marker_frame import MarkerFrame
from tcr_hardware.natnet.model_decoder import decode_models
from tcr_hardware.natnet.protocol import Version
from tcr_hardware.rigid_transform import IDENTITY, RigidTransform

RINGS = 13
NAMES = [f"m{i}.n{j}" for i in range(RINGS) for j in (1, 2, 3)]
ANGLES = 2 * np.pi * np.arange(3) / 3
#: Rings of 70 mm diameter, 49.55 mm apart, hanging down.
REST = np.array([[0.035 * np.cos(a), 0.035 * np.sin(a), -0.04955 * i] for i in range(RINGS) for a in ANGLES])
IDS = [(i + 1) << 16 | j for i in range(RINGS) for j in (1, 2, 3)]
MODELS = decode_models(
    wire.simple_models((4, 1), **{f"m{i}": ["n1", "n2", "n3"] for i in range(RINGS)}), Version(4, 1)
)
SEEN, OCCLUDED, FILLED = 0x0A, 0x0B, 0x0E
LABELLED = [NodeMarker(name, label=name) for name in NAMES]
PLAIN = [NodeMarker(name) for name in NAMES]


def shifted(*by):
    return REST + np.array(by)


def frame(
    positions, t=0.0, *, params=None, leave_out=(), residual=0.0, models=MODELS, named=True, order=None
):
    """A frame with the nodes at ``positions``, as labelled or as unlabelled markers."""
    params = params or {}
    rows = [row for row in (order if order is not None else range(len(positions))) if row not in leave_out]
    if named:
        markers = [(IDS[row], positions[row], 0.01, params.get(row, SEEN), residual) for row in rows]
        content = Wire(markers=markers)
    else:
        content = Wire(unlabelled=[positions[row] for row in rows])
    data = decode_frame(wire.frame_payload((4, 1), content), Version(4, 1))
    return MarkerFrame(1, 0, t, t, None, data, models)


@pytest.mark.parametrize("by", ["label", "numbers"])
def test_every_labelled_node_lands_in_its_row_whatever_the_order_of_the_markers(by):
    nodes = LABELLED
    if by == "numbers":
        nodes = [
            NodeMarker(name, asset=n >> 16, member=n & 0xFFFF) for name, n in zip(NAMES, IDS, strict=True)
        ]
    order = np.random.default_rng(1).permutation(39)
    located = MarkerMap(nodes, REST).locate(frame(REST, order=order))
    assert located.valid.all()
    assert located.positions.dtype == np.float32
    assert located.positions == pytest.approx(REST, abs=1e-7)


@pytest.mark.slow
@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1))
def test_unlabelled_nodes_are_followed_through_motion_loss_and_ghosts(seed):
    """A robot that moves by up to 5 mm per frame, markers shuffled, some hidden, ghosts elsewhere."""
    rng = np.random.default_rng(seed)
    markers, now = MarkerMap(PLAIN, REST), REST.copy()
    for k in range(20):
        now = now + rng.uniform(-0.0028, 0.0028, now.shape)
        hidden = set(rng.choice(39, rng.integers(0, 6), replace=False).tolist()) if k % 3 else set()
        ghosts = rng.uniform(0.2, 1.0, (3, 3))
        shown = frame(
            np.vstack([now, ghosts]), 0.004 * k, named=False, leave_out=hidden, order=rng.permutation(42)
        )
        located = markers.locate(shown)
        assert set(np.flatnonzero(~located.valid)) == hidden
        assert located.positions[located.valid] == pytest.approx(now[located.valid], abs=1e-6)
        assert np.isnan(located.positions[~located.valid]).all()


def test_unlabelled_markers_flagged_in_the_labelled_list_are_used_too():
    content = Wire(markers=[(50_000 + k, p, 0.01, 0x12, 0.0) for k, p in enumerate(REST[::-1])])
    data = decode_frame(wire.frame_payload((4, 1), content), Version(4, 1))
    located = MarkerMap(PLAIN, REST).locate(MarkerFrame(1, 0, 0.0, 0.0, None, data, None))
    assert located.valid.all()
    assert located.positions == pytest.approx(REST, abs=1e-7)


def test_both_forms_of_dropout_are_invalid_and_say_why():
    positions = REST.copy()
    positions[5] = np.nan
    shown = frame(positions, params={1: OCCLUDED, 2: FILLED}, leave_out=(7,))
    located = MarkerMap(LABELLED, REST).locate(shown)
    reasons = {k: reason for k, reason in enumerate(located.reasons) if reason}
    assert reasons == {1: "occluded", 2: "filled", 5: "not finite", 7: "missing"}
    assert np.flatnonzero(~located.valid).tolist() == [1, 2, 5, 7]
    assert np.isnan(located.positions[[1, 2, 5, 7]]).all()


def test_markers_with_a_large_residual_are_not_used():
    markers = MarkerMap(LABELLED, REST, max_residual_m=0.001)
    assert markers.locate(frame(REST, residual=0.0009)).valid.all()
    assert set(markers.locate(frame(REST, residual=0.0011)).reasons) == {"residual"}


def test_swapped_labels_are_never_believed_however_long_they_last():
    markers = MarkerMap(LABELLED, REST)
    markers.locate(frame(REST, 0.0))
    swapped = REST.copy()
    swapped[[3, 4]] = swapped[[4, 3]]
    for k in range(1, 500):
        located = markers.locate(frame(swapped, 0.01 * k))
        assert np.flatnonzero(~located.valid).tolist() == [3, 4]
        assert located.reasons[3] == located.reasons[4] == "jump"
    assert markers.locate(frame(REST, 6.0)).valid.all()
    markers.locate(frame(swapped, 6.1))
    markers.reset()  # the operator says that it is right so
    assert markers.locate(frame(swapped, 6.2)).valid.all()


def test_the_gate_grows_with_the_time_that_a_node_was_hidden_up_to_its_limit():
    gate = Gate(smallest_m=0.010, speed_m_s=0.1, largest_m=0.020)
    moved = shifted(0.0, 0.0, 0.015)
    for elapsed, expected in ((0.01, False), (0.06, True), (10.0, True)):
        markers = MarkerMap(LABELLED, REST, gate=gate)
        markers.locate(frame(REST, 0.0))
        assert markers.locate(frame(moved, elapsed)).valid.all() == expected
    far = shifted(0.0, 0.0, 0.021)
    markers = MarkerMap(LABELLED, REST, gate=gate)
    markers.locate(frame(REST, 0.0))
    assert not markers.locate(frame(far, 1e6)).valid.any()


def test_the_expectation_of_an_observer_replaces_the_last_sight():
    markers, moved = MarkerMap(LABELLED, REST), shifted(0.1, 0.0, 0.0)
    markers.locate(frame(REST, 0.0))
    assert set(markers.locate(frame(moved, 0.1)).reasons) == {"jump"}
    assert markers.locate(frame(moved, 0.1), expected=moved + 0.001).valid.all()


def test_a_jump_of_the_whole_scene_is_refused_as_a_jump_of_every_node():
    markers = MarkerMap(PLAIN, REST)
    assert markers.locate(frame(REST, named=False)).valid.all()
    jumped = markers.locate(frame(shifted(0.5, 0.0, 0.0), 0.01, named=False))
    assert not jumped.valid.any()


@pytest.mark.parametrize("axis", [0, 1])
def test_what_lies_where_it_was_in_a_picture_that_has_jumped_does_so_by_chance(axis):
    """A mirrored picture: markers on the mirror stand still."""
    mirrored = REST * np.where(np.arange(3) == axis, -1.0, 1.0)
    assert (np.linalg.norm(mirrored - REST, axis=1) < 0.001).any() or axis == 0
    markers = MarkerMap(LABELLED, REST)
    markers.locate(frame(REST, 0.0))
    for k in range(1, 50):
        assert set(markers.locate(frame(mirrored, 0.01 * k)).reasons) == {"jump"}
    assert markers.locate(frame(REST, 1.0)).valid.all()


def test_of_a_picture_of_which_half_has_jumped_the_other_half_is_used():
    markers = MarkerMap(LABELLED, REST)
    markers.locate(frame(REST, 0.0))
    rows = np.arange(len(REST)) < len(REST) // 2
    half = np.where(rows[:, None], shifted(0.1, 0.0, 0.0), REST)
    assert markers.locate(frame(half, 0.01)).valid.tolist() == (~rows).tolist()


def test_without_names_labelled_nodes_are_invalid():
    markers = MarkerMap([*LABELLED[:2], NodeMarker("m0.n3", asset=1, member=3)], REST[:3])
    assert markers.locate(frame(REST, models=None)).reasons == ("no names", "no names", "")


def test_names_that_change_move_the_nodes_to_their_new_numbers():
    markers = MarkerMap(LABELLED[:3], REST[:3])
    assert markers.locate(frame(REST)).valid.all()
    names = {"extra": ["a"], "m0": ["n1", "n2", "n3"]}
    renumbered = decode_models(wire.simple_models((4, 1), **names), Version(4, 1))
    moved = np.vstack([REST[:3] + 1.0, REST[:3]])  # the old numbers now belong to something else
    located = markers.locate(frame(moved, 0.01, models=renumbered))
    assert located.valid.all()
    assert located.positions == pytest.approx(REST[:3], abs=1e-7)


def test_unknown_labels_are_all_named_with_what_there_is():
    markers = MarkerMap(
        [*LABELLED[:2], NodeMarker("a", label="m0.n9"), NodeMarker("b", label="x.y")], REST[:4]
    )
    with pytest.raises(MarkerMapError, match=r"m0\.n9, x\.y.*m0\.n1") as caught:
        markers.resolve(MODELS)
    assert caught.value.labels == ("m0.n9", "x.y")
    assert "m12.n3" in caught.value.known
    assert markers.locate(frame(REST)).reasons == ("", "", "unknown label", "unknown label")


@pytest.mark.parametrize("half", [{"asset": 1}, {"member": 1}, {"label": "a.b", "asset": 1, "member": 2}])
def test_half_an_identity_is_refused(half):
    with pytest.raises(ValueError, match="give a label, or asset and member"):
        NodeMarker("m1.n1", **half)


def test_two_nodes_with_one_marker_are_refused():
    twice = [NodeMarker("m1.n1", label="a.b"), NodeMarker("m1.n2"), NodeMarker("m2.n1", label="a.b")]
    with pytest.raises(SharedMarkerError, match=r"m1\.n1 and m2\.n1 .* a\.b"):
        MarkerMap(twice, REST[:3])
    MarkerMap([NodeMarker("m1.n1"), NodeMarker("m1.n2")], REST[:2])


@pytest.mark.parametrize("gate", [Gate(np.inf, np.inf, np.inf), Gate(0.01, 0.0, 0.02)])
def test_a_gate_may_be_open_or_not_grow_at_all(gate):
    for nodes, named in ((LABELLED, True), (PLAIN, False)):
        markers = MarkerMap(nodes, REST, gate=gate)
        assert markers.locate(frame(REST, 0.0, named=named)).valid.all()
        assert markers.locate(frame(REST, 0.0, named=named)).valid.all()
        far = markers.locate(frame(shifted(0.0, 0.0, 0.022), 1.0, named=named))
        assert far.valid.all() == np.isinf(gate.largest_m)


# ---- transform and calibration ----

rotations = st.integers(0, 2**32 - 1).map(lambda seed: Rotation.random(random_state=seed).as_matrix())
#: Camera system with y up: x_rig = x, y_rig = -z, z_rig = y.
Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


@settings(max_examples=50)
@given(rotation=rotations, scale=st.sampled_from([1.0, 0.001, 0.5]))
def test_a_transform_keeps_distances_undoes_itself_and_survives_a_file(rotation, scale):
    transform = RigidTransform(rotation, np.array([0.1, -0.2, 0.3]), scale)
    points = np.random.default_rng(0).normal(size=(7, 3))
    there = transform.apply(points)
    assert np.linalg.norm(there[1:] - there[:-1], axis=1) == pytest.approx(
        scale * np.linalg.norm(points[1:] - points[:-1], axis=1)
    )
    assert transform.inverse_apply(there) == pytest.approx(points)
    again = RigidTransform.from_dict(transform.as_dict())
    assert again.apply(points) == pytest.approx(there, abs=1e-12)


@pytest.mark.parametrize(
    ("rotation", "translation", "scale"),
    [
        (np.diag([1.0, 1.0, -1.0]), np.zeros(3), 1.0),
        (2 * np.eye(3), np.zeros(3), 1.0),
        (np.full((3, 3), np.nan), np.zeros(3), 1.0),
        (np.eye(2), np.zeros(3), 1.0),
        (np.eye(3), np.array([0, np.inf, 0]), 1.0),
        (np.eye(3), np.zeros(3), 0.0),
    ],
)
def test_what_is_no_rigid_transform_is_refused(rotation, translation, scale):
    with pytest.raises(ValueError, match=r"rotation|shapes|translation"):
        RigidTransform(rotation, translation, scale)


def test_a_transform_does_not_change_behind_ones_back():
    rotation = np.eye(3)
    transform = RigidTransform(rotation, np.zeros(3))
    rotation[0, 0] = 5.0
    assert transform.rotation[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        transform.translation[0] = 1.0
    assert IDENTITY.apply([1.0, 2.0, 3.0]).tolist() == [1.0, 2.0, 3.0]


@settings(max_examples=50)
@given(seed=st.integers(0, 2**32 - 1), level=st.booleans(), k=st.sampled_from([3, 39]))
def test_calibration_finds_the_transform_that_made_the_markers(seed, level, k):
    """Any heading and origin, y up; a tilted base too unless the vertical is trusted."""
    rng = np.random.default_rng(seed)
    tilt = np.eye(3) if level else Rotation.from_rotvec(rng.uniform(-0.05, 0.05, 3)).as_matrix()
    heading = Rotation.from_rotvec([0, 0, rng.uniform(-np.pi, np.pi)]).as_matrix()
    true = RigidTransform(tilt @ heading @ Y_UP, rng.uniform(-2, 2, 3))
    found = calibrate(true.inverse_apply(REST[:k]), REST[:k], up_axis="y", level=level)
    assert found.transform.rotation == pytest.approx(true.rotation, abs=1e-9)
    assert found.transform.translation == pytest.approx(true.translation, abs=1e-9)
    assert found.residual_max_m < 1e-9
    assert abs(found.scale_error) < 1e-9
    vertical = np.degrees(np.arccos(np.clip((true.rotation @ [0, 1, 0])[2], -1, 1)))
    assert found.tilt_deg == pytest.approx(vertical, abs=1e-5)


def test_calibration_is_the_least_squares_fit():
    rng = np.random.default_rng(3)
    measured = RigidTransform(Y_UP, np.array([0.1, 0.2, 0.3])).inverse_apply(REST) + rng.normal(
        0, 2e-4, REST.shape
    )
    found = calibrate(measured, REST, up_axis="y")

    def cost(transform):
        return ((transform.apply(measured) - REST) ** 2).sum()

    best = cost(found.transform)
    assert found.residual_rms_m == pytest.approx(np.sqrt(best / 39))
    for _ in range(50):
        turn = Rotation.from_rotvec(rng.normal(0, 1e-4, 3)).as_matrix()
        shift = rng.normal(0, 1e-4, 3)
        other = RigidTransform(turn @ found.transform.rotation, found.transform.translation + shift)
        assert cost(other) > best


def measured_by(transform=None):
    return (transform or RigidTransform(Y_UP, np.zeros(3))).inverse_apply(REST)


def test_the_wrong_up_axis_is_refused_and_the_right_one_named():
    with pytest.raises(CalibrationError, match="angle between z") as caught:
        calibrate(measured_by(), REST, up_axis="z")
    assert caught.value.value == pytest.approx(90.0)
    assert "close to y" in caught.value.hint


def test_millimetres_taken_for_metres_are_refused():
    with pytest.raises(CalibrationError, match="distances") as caught:
        calibrate(1000.0 * measured_by(), REST, up_axis="y")
    assert "1000 times" in caught.value.hint
    assert calibrate(1000.0 * measured_by(), REST, up_axis="y", scale_m=0.001).residual_max_m < 1e-9


def test_base_labels_in_the_wrong_sense_are_refused():
    with pytest.raises(CalibrationError) as caught:
        calibrate(measured_by()[[0, 2, 1]], REST[:3], up_axis="y")
    assert caught.value.value == pytest.approx(180.0)
    assert "counter-clockwise" in caught.value.hint


def test_exchanged_labels_or_a_bent_robot_are_refused():
    measured = measured_by()
    measured[[10, 20]] = measured[[20, 10]]
    with pytest.raises(CalibrationError, match="residual") as caught:
        calibrate(measured, REST, up_axis="y")
    assert (caught.value.unit, caught.value.limit) == ("mm", 2.0)


def test_too_few_markers_or_a_line_of_them_are_refused():
    hidden = measured_by()
    hidden[2:] = np.nan
    with pytest.raises(CalibrationError, match="number of markers seen is 2"):
        calibrate(hidden, REST, up_axis="y")
    with pytest.raises(CalibrationError, match="line"):
        calibrate(measured_by()[::3], REST[::3], up_axis="y")
    with pytest.raises(ValueError, match="up_axis"):
        calibrate(measured_by(), REST, up_axis="w")


def test_averaging_leaves_out_what_was_not_seen():
    rng = np.random.default_rng(5)
    positions = REST + rng.normal(0, 1e-3, (400, *REST.shape))
    valid = rng.random((400, 39)) > 0.3
    valid[:, 7] = False
    positions[~valid] = np.nan
    mean = average(positions, valid)
    seen = np.delete(np.arange(39), 7)
    assert mean.seen.tolist() == valid.sum(axis=0).tolist()
    assert mean.mean[seen] == pytest.approx(REST[seen], abs=4e-4)
    assert mean.deviation[seen] == pytest.approx(np.sqrt(3) * 1e-3, rel=0.2)
    assert np.isnan(mean.mean[7]).all()
    assert np.isnan(mean.deviation[7])
