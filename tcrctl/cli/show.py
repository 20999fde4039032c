"""``tcrctl show SPEC``: an experiment with every default filled in."""

from __future__ import annotations

from tcrctl.cli.options import AsJson, IsRobot, Overrides, Spec


def show(spec: Spec, overrides: Overrides = None, robot: IsRobot = False, as_json: AsJson = False) -> None:
    r"""Print an experiment as it will run: defaults filled in, --set applied.

    \b
    Examples:
      tcrctl show letter_t
      tcrctl show letter_t --set controller.tension=off --json
      tcrctl show --robot tcr700
    """
    from tcrctl import strict_yaml
    from tcrctl.robot.description import RobotDescription, load_robot
    from tcrctl.spec import ExperimentSpec, load_spec

    found: ExperimentSpec | RobotDescription
    found = load_robot(spec, overrides=overrides or ()) if robot else load_spec(spec, overrides or ()).spec
    if as_json:
        print(found.model_dump_json())
    else:
        print(strict_yaml.dumps(found.model_dump(mode="json")), end="")
