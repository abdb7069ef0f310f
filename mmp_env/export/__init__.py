"""Exports plans as tables, NumPy archives and ROS 2 trajectories, and cells as MJCF.

    export_plan(plan, "all.yaml")                                     # one JointTrajectory for all arms
    export_plan(plan, "{arm}.yaml", joint_names="{arm}_{joint}")      # one for each arm

docs/how-to/export.md describes the formats and their use.
"""

from mmp_env.export.formats import FORMATS, check_target, export_plan
from mmp_env.export.joint_names import JOINT_NAMES
from mmp_env.export.ros import JointTrajectory, load_joint_trajectory

__all__ = ["FORMATS", "JOINT_NAMES", "JointTrajectory", "check_target", "export_plan", "load_joint_trajectory"]
