"""Inverse kinematics: all configurations of one arm that bring its tool frame to a pose.

`chain` has the kinematics, `numeric` finds configurations of any chain, `refinement` makes them exact, `turns` adds the
whole turns that fit in the joint limits, and `freedom` lists the rotations that a pose leaves free.
"""

from mmp_env.ik.branches import branches
from mmp_env.ik.freedom import FREE, Free

__all__ = ["FREE", "Free", "branches"]
