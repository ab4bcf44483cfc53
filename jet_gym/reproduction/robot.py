"""Table 1: the robot."""

from __future__ import annotations

from jet_gym.reproduction.model import Chapter, Settings, Table
from jet_gym.robot import jet_hr1
from jet_gym.utils.progress import Progress


def robot_chapter(settings: Settings, report: Progress) -> Chapter:  # noqa: ARG001
    """Set the URDF's numbers beside the paper's Table 1."""
    robot = jet_hr1()
    servo = {round(s.torque, 3) for s in robot.servos}
    ratios = sorted({s.gear_ratio for s in robot.servos} - {1.0})
    fan = robot.fans[0]
    rows = (
        ("weight", "6.8 kg", f"{robot.mass:.3g} kg"),
        ("height", "608 mm", f"{1e3 * robot.height:.4g} mm"),
        ("degrees of freedom", "12", f"{len(robot.joint_names)}"),
        ("length of leg", "460 mm", f"{1e3 * robot.leg_length:.4g} mm"),
        ("largest thrust", "23 N", f"{fan.max_thrust:g} N"),
        ("joint servo", "7.8 N m", ", ".join(f"{torque:g} N m" for torque in sorted(servo))),
        ("gear ratio of the roll joints", "1:2.43", ", ".join(f"1:{ratio:g}" for ratio in ratios)),
    )
    report(1, 1)
    return Chapter(
        "robot",
        "The robot",
        (
            "The paper states these numbers. How the mass is split, the joints' ranges, the foot's size, where the "
            "fan sits, its lag and the servos' speed it does not state; this package estimates them. The robot's "
            "file, urdf/jet_hr1.urdf, marks each number as stated or estimated, and the last chapter shows what "
            "some of the estimates do.",
        ),
        tables=(Table("table-1-robot", "Table 1: main specification", ("", "paper", "here"), rows),),
    )
