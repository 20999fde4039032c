"""The table: every experiment of the paper with its figure, the bar, and the goal. Section and figures: [TCR, V].

Shipped closed-loop experiments run on a plant that differs from the model, springs 30 % softer and density 20 %
higher, with noisy and late measurements. Times are multiples of a fixed workload, ``tcrctl.paper.step_times``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from tcrctl.paper.job import Check, Run
from tcrctl.paper.row import Result, Row, found, total, worst

LETTERS: Final = ("letter_i", "heart", "letter_d", "letter_u", "letter_t")
PERFECT: Final = tuple(Run(name, ("plant.mismatch=off",)) for name in LETTERS)
MISMATCHED: Final = tuple(Run(name) for name in LETTERS)
FIXED: Final = Run("fixed_point_rotation")
CONE: Final = Run("cone_frustum")
HELIX: Final = Run("helix")
LASER: Final = Run("laser_pipe")
SCAN: Final = Run("box_scan")
FAST_SCAN: Final = Run(
    "box_scan",
    (
        "trajectory.approach_s=14",
        "trajectory.insert_s=4",
        "trajectory.tilt_s=6",
        "trajectory.turn_s=26",
        "trajectory.return_s=6",
    ),
)
POLYLINE: Final = Run("box_polyline")
DYNAMIC: Final = {total_s: Run(f"dynamic_{total_s}s") for total_s in (10, 45, 90)}
STATIC: Final = {
    total_s: Run(f"dynamic_{total_s}s", ("controller.model=static",)) for total_s in (10, 45, 90)
}
KINEMATIC: Final = Run("fixed_point_rotation", ("controller={kind: kinematic, output: pose}",))
LITERAL: Final = Run(
    "letter_t",
    ("controller.prediction=literal", "controller.tension=off", "controller.integral=off"),
)
TIMES: Final = Check("step_times", alone=True)

POSITION: Final = worst("position_error_mm.max")
THETA: Final = worst("theta_x_error_rad.max", "theta_y_error_rad.max")
X_RMSE: Final = worst("x_error_mm.rms")
X_MAX: Final = worst("x_error_mm.max")


def inspection(results: Sequence[Result]) -> str:
    """Return what was found in the box, and whether it was touched."""
    (task,) = (result["task"] for result in results)
    touched = f"collision at {task['collision_s']:.3g} s" if task["collision"] else "no collision"
    return f"{task['detected']} of {len(task['objects'])}, {touched}"


def ending(name: str) -> Callable[[Sequence[Result]], str]:
    """Return what tells a value of a run, or when a limit stopped it."""

    def tell(results: Sequence[Result]) -> str:
        (result,) = results
        (value,) = found(result, name)
        if result["status"] == "aborted":
            return f"stopped at {result['duration_s']:.3g} s with {value:.3g}"
        return f"{value:.3g}"

    return tell


def with_ms(part: str, quantile: str) -> Callable[[Sequence[Result]], str]:
    """Return what tells a time as a multiple of the workload, and in milliseconds here and now."""

    def tell(results: Sequence[Result]) -> str:
        (result,) = results
        return f"{result[part][quantile]:.3g} ({result[f'{part}_ms'][quantile]:.3g} ms)"

    return tell


def beams(results: Sequence[Result]) -> str:
    """Return how many beams pass."""
    passed = found(results[0], "task.targets.beam_passes")
    return f"{sum(passed)} of {len(passed)}"


ROWS: Final = (
    Row("letters_perfect", "letters, position error, perfect model", "2.30 (T)", "mm", 1.0, 0.2,
        PERFECT, POSITION),
    Row("letters", "letters, position error", "6.26 .. 10.01 (bench)", "mm", 3.0, 0.5, MISMATCHED, POSITION),
    Row("fixed_point", "fixed-point rotation, position error", "12.04", "mm", 3.0, 1.0, (FIXED,), POSITION),
    Row("cone_frustum", "cone frustum, position error", "10.17", "mm", 3.0, 1.0, (CONE,), POSITION),
    Row("helix", "helix, position error", "8.78", "mm", 3.0, 1.0, (HELIX,), POSITION),
    Row("fixed_point_theta", "fixed-point rotation, angle error", "0.181", "rad", 0.035, 0.01, (FIXED,), THETA),
    Row("cone_frustum_theta", "cone frustum, angle error", "0.141", "rad", 0.035, 0.01, (CONE,), THETA),
    Row("helix_theta", "helix, angle error", "0.087", "rad", 0.035, 0.01, (HELIX,), THETA),
    Row("dynamic_10s", "turn in 10 s, RMSE in x", "2.56", "mm", 1.0, 0.3, (DYNAMIC[10],), X_RMSE),
    Row("dynamic_45s", "turn in 45 s, RMSE in x", "0.16", "mm", 0.16, 0.05, (DYNAMIC[45],), X_RMSE),
    Row("dynamic_90s", "turn in 90 s, RMSE in x", "0.07", "mm", 0.07, 0.03, (DYNAMIC[90],), X_RMSE),
    Row("dynamic_10s_max", "turn in 10 s, x error", "10.15", "mm", None, None, (DYNAMIC[10],), X_MAX),
    Row("static_10s", "turn in 10 s with a static model, x error", "diverges", "mm", None, None, (STATIC[10],),
        X_MAX, text=ending("x_error_mm.max"), may_stop=True),
    Row("static_45s", "turn in 45 s with a static model, x error", "diverges", "mm", None, None, (STATIC[45],),
        X_MAX, text=ending("x_error_mm.max"), may_stop=True),
    Row("static_90s", "turn in 90 s with a static model, x error", "9.43", "mm", None, None, (STATIC[90],),
        X_MAX, text=ending("x_error_mm.max"), may_stop=True),
    Row("kinematic", "fixed-point rotation by resolved rates, position error", "-", "mm", None, None,
        (KINEMATIC,), POSITION, text=ending("position_error_mm.max"), may_stop=True),
    Row("literal", "letter T, the algorithm as printed, position error", "8.57 (bench)", "mm", None, None,
        (LITERAL,), POSITION, text=ending("position_error_mm.max"), may_stop=True),
    Row("laser_pipe", "laser, position error at the targets", "8.7, 13.9", "mm", 2.0, 0.5, (LASER,),
        worst("task.targets.position_error_mm")),
    Row("laser_beam", "laser, beams through their pipes", "2 of 2", "", 2, 2, (LASER,),
        total("task.targets.beam_passes"), at_least=True, text=beams),
    Row("box_scan", "box scan, objects found before any collision", "3 of 3", "", 3, 3, (SCAN,),
        total("task.detected"), at_least=True, text=inspection),
    Row("box_scan_time", "box scan, time until all are found", "84", "s", 84.0, 60.0, (SCAN,),
        worst("task.detection_s")),
    Row("box_scan_60s", "box scan of 60 s, objects found", "-", "", None, 3, (FAST_SCAN,),
        total("task.detected"), at_least=True, text=inspection),
    Row("box_polyline", "box polyline, objects found", "1 of 3, collision", "", None, None, (POLYLINE,),
        total("task.detected"), at_least=True, text=inspection),
    Row("table2", "Table II, mean endpoint error of the model", "7.77", "mm", 7.0, 5.0, (Check("table2"),),
        worst("mean_error_mm")),
    Row("control_p50", "control step, two segments, median", "< 10 ms (MATLAB)", "workload", 1.3, 0.7, (TIMES,),
        worst("control.p50"), text=with_ms("control", "p50")),
    Row("control_p99", "control step, two segments, 99 %", "< 10 ms (MATLAB)", "workload", 2.9, 1.5, (TIMES,),
        worst("control.p99"), text=with_ms("control", "p99")),
    Row("plant_step", "plant step of 1 ms, 13 modules, median", "1.7 ms (Exudyn)", "workload", 0.12, 0.07,
        (TIMES,), worst("plant.p50"), text=with_ms("plant", "p50")),
)  # fmt: skip
"""Every row, in the order of the paper."""
