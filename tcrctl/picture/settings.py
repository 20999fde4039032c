"""What ``safety.picture`` of an experiment may say, units in the key names."""

from __future__ import annotations

from pydantic import Field

from tcrctl.config.settings import Settings, quantity


class PictureSettings(Settings):
    """When markers, rings and the frame of the cameras are not believed."""

    judged: bool = Field(default=True, description="judge the picture at all")
    side_mm: float = quantity(
        "mm", "a marker is left out whose distance to its ring's others has changed by more since the start",
        1.2, gt=0,
    )  # fmt: skip
    joint_mm: float = quantity(
        "mm", "a ring is left out that has moved by more against its neighbours; the limit grows with bending",
        2.2, gt=0,
    )  # fmt: skip
    twist_deg: float = quantity(
        "deg", "a ring is left out that has turned about its axis by more against its neighbours", 15.0, gt=0
    )
    frame_mm: float = quantity(
        "mm",
        "the frame is not believed if the first ring alone has moved by more against the base",
        1.8,
        gt=0,
    )
    frame_deg: float = quantity(
        "deg",
        "the frame is not believed if the first ring alone has turned by more against the base",
        6.0,
        gt=0,
    )
    least_share: float = quantity(
        "1",
        "the drives are held if a smaller share of the markers, or of the joints between rings, is believed",
        0.5,
        gt=0,
        le=1,
    )
    stop_s: float = quantity(
        "s", "the run is stopped if they were held for so long, steps that were missed included", 0.2, ge=0
    )
    start_side_mm: float = quantity(
        "mm", "before arming: sides of a ring may differ by so much from the robot's", 10.0, gt=0
    )
    start_joint_mm: float = quantity(
        "mm",
        "before arming: a ring may be so far from where its neighbour carries it in the model",
        12.0,
        gt=0,
    )
    start_twist_deg: float = quantity(
        "deg", "before arming: and be turned by so much about its axis against it", 25.0, gt=0
    )
    start_frame_mm: float = quantity(
        "mm", "before arming: the first ring may be so far from where the base carries it", 8.0, gt=0
    )
    start_frame_deg: float = quantity(
        "deg",
        "before arming: the whole robot may be turned or tilted by so much against the model",
        10.0,
        gt=0,
    )
    start_place_mm: float = quantity(
        "mm", "before arming: a ring may be so far from the model laid over the picture", 80.0, gt=0
    )
