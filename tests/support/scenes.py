"""MuJoCo models of two small arms in one world, made for tests."""

ACTUATOR = '<position joint="{name}" kp="400" kv="40"/>'


def arm(prefix, x, *, hand="", joints=3):
    """An arm of `joints` hinges that stands at `x` on a pedestal, into which its first link reaches."""
    inner = ""
    for k in range(joints, 0, -1):
        axis = "0 0 1" if k % 2 else "0 1 0"
        inner = f"""
        <body name="{prefix}link{k}" pos="0 0 {0.06 if k == 1 else 0.2}">
          <joint name="{prefix}joint{k}" axis="{axis}" range="-2.5 2.5" damping="2"/>
          <geom type="capsule" size="0.035" fromto="0 0 0 0 0 0.15"/>{hand if k == joints else ""}{inner}
        </body>"""
    return f"""
      <body name="{prefix}base" pos="{x} 0 0"><geom type="cylinder" size="0.06 0.03" pos="0 0 0.03"/>{inner}</body>"""


def fingers(prefix):
    """Two fingers on slides."""
    finger = """<body pos="0 {y} 0.22"><joint name="{name}" type="slide" axis="0 {s} 0" range="0 0.02"/>
      <geom type="box" size="0.008 0.008 0.03"/></body>"""
    sides = ((1, "finger1"), (-1, "finger2"))
    return "".join(finger.format(y=0.02 * s, s=s, name=prefix + name) for s, name in sides)


def scene(*, arms=None, world="", after="", actuator=ACTUATOR, asset="", joints=3, exclude=True):
    """A model of the arms `l_` and `r_`, 0.8 m apart on a floor, with more bodies in the world.

    `exclude` lets their first links overlap with the pedestals; otherwise these rub.
    """
    arms = arm("l_", -0.4, joints=joints) + arm("r_", 0.4, joints=joints) if arms is None else arms
    names = [
        f"{prefix}joint{k}" for prefix in ("l_", "r_") for k in range(1, joints + 1) if f"{prefix}joint{k}" in arms
    ]
    pedestals = [prefix for prefix in ("l_", "r_") if f'"{prefix}base"' in arms and f'"{prefix}link1"' in arms]
    if exclude:
        pairs = "".join(f'<exclude body1="{prefix}base" body2="{prefix}link1"/>' for prefix in pedestals)
        after = f"<contact>{pairs}</contact>{after}"
    motors = "".join(actuator.format(name=name) for name in names)
    return f"""
    <mujoco model="two arms"><compiler angle="radian"/><option integrator="implicitfast"/><asset>{asset}</asset>
      <worldbody><geom name="floor" type="plane" size="0 0 1"/>{world}{arms}</worldbody>
      <actuator>{motors}</actuator>{after}
    </mujoco>"""
