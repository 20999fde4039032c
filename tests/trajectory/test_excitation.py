"""Laws of the excitation: taut, within five minutes, from rest to rest, and poses that nobody chose."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.errors import InputError
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.trajectory.drives import time_law
from tcrctl.trajectory.excitation import poses_of, program, swings
from tcrctl.trajectory.excitation_settings import DrawSettings, ExcitationSettings, ShakeSettings

FEW = ExcitationSettings(kind="excitation", poses=3, held_out=2)


def test_as_shipped_it_ends_within_five_minutes(tcr700):
    assert time_law(program(ExcitationSettings(kind="excitation"), tcr700)).total <= 300.0


def test_every_drawn_pose_is_taut_by_the_model(tcr700):
    for pose in poses_of(FEW, tcr700):
        tension = equilibrium(tcr700.model, 1e-3 * pose, tcr700.weight, tcr700.rest.q).tension
        assert FEW.draw.floor_n <= tension.min()
        assert tension.max() <= FEW.draw.ceiling_n


def test_poses_held_out_do_not_depend_on_those_that_are_chosen(tcr700):
    chosen = FEW.model_copy(update={"poses_mm": ((10.0,) * 6, (20.0,) * 6)})
    np.testing.assert_array_equal(poses_of(chosen, tcr700)[2:], poses_of(FEW, tcr700)[3:])


def test_it_begins_and_ends_at_zero_and_pulls_every_cable_both_ways(tcr700):
    drives = np.array([leg.drives_mm for leg in program(FEW, tcr700).legs])
    np.testing.assert_allclose(drives[-1], 0.0, atol=1e-12)
    pulls = drives[: 4 * tcr700.n_cables]
    for cable in range(tcr700.n_cables):
        alone = pulls[4 * cable : 4 * cable + 4]
        assert alone[:, cable].tolist() == [5.0, 0.0, -5.0, 0.0]
        assert not np.delete(alone, cable, axis=1).any()


def test_no_drive_is_asked_for_more_than_its_speed(tcr700):
    settings = ExcitationSettings(kind="excitation", poses=6, held_out=0, speed_mm_s=30.0)
    legs, last = program(settings, tcr700).legs, np.zeros(6)
    for leg in legs:
        wanted = np.array(leg.drives_mm)
        factor = 1.0 if leg.motion == "constant_speed" else 2.0
        assert factor * np.abs(wanted - last).max() / leg.duration_s <= 30.0 + 1e-9
        last = wanted


def test_swings_die_away_to_and_fro():
    found = swings(ShakeSettings(size_mm=4.0, swings=4))
    assert found.tolist() == [4.0, -3.0, 2.0, -1.0]


@pytest.mark.slow
def test_poses_that_cannot_be_taut_are_refused(tcr700):
    settings = FEW.model_copy(update={"draw": DrawSettings(floor_n=50.0, ceiling_n=51.0)})
    with pytest.raises(InputError, match="could be drawn"):
        poses_of(settings, tcr700)
