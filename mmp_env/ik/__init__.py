"""Inverse kinematics: all configurations of one arm that bring its tool frame to a pose.

`chain` has the kinematics. `closed_form` finds the special geometry that most arms have, and `six_hinges` solves it.
The `numeric` solver is for other chains. `refinement` makes results exact, `self_motion` follows the curves of
redundant arms, and `turns` adds whole turns within the joint limits. `freedom` samples the rotations that a pose leaves
free. docs/explanation/inverse-kinematics.md describes the method.
"""

from mmp_env.ik.branches import branches, branches_by_posture, nearest_beyond_limits
from mmp_env.ik.freedom import FREE, Free

__all__ = ["FREE", "Free", "branches", "branches_by_posture", "nearest_beyond_limits"]
