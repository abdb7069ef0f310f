"""Descriptions of robots with slides, made for tests: an arm on a rail (URDF), and a gantry (MJCF)."""

_AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
_OFFSETS = ("0 0 0.1", "0 0 0.12", "0 0 0.3", "0 0 0.1", "0 0 0.15", "0 0 0.08")
_LENGTHS = (0.06, 0.24, 0.06, 0.1, 0.04, 0.04)


def rail_urdf() -> str:
    """Returns an arm of six hinges on a rail of 1 m along y; its links are capsules of cylinders and balls."""
    links, joints = [], []
    for k, (axis, offset, length) in enumerate(zip(_AXES, _OFFSETS, _LENGTHS, strict=True), 1):
        links.append(
            f'<link name="link{k}"><collision><origin xyz="0 0 {length / 2}"/>'
            f'<geometry><cylinder radius="0.035" length="{length}"/></geometry></collision></link>'
        )
        joints.append(
            f'<joint name="hinge{k}" type="revolute"><parent link="{f"link{k - 1}" if k > 1 else "carriage"}"/>'
            f'<child link="link{k}"/><origin xyz="{offset}"/><axis xyz="{axis}"/>'
            '<limit lower="-2.6" upper="2.6" effort="60" velocity="1.5"/></joint>'
        )
    return f"""<?xml version="1.0"?>
<robot name="rail">
  <link name="bed"><collision><origin xyz="0 0 -0.03"/><geometry><box size="0.1 1.3 0.06"/></geometry></collision>
  </link>
  <link name="carriage"><collision><origin xyz="0 0 0.04"/><geometry><box size="0.12 0.12 0.06"/></geometry></collision>
  </link>
  {"".join(links)}
  <link name="tool0"/>
  <joint name="rail" type="prismatic"><parent link="bed"/><child link="carriage"/><axis xyz="0 1 0"/>
    <limit lower="-0.5" upper="0.5" effort="200" velocity="0.8"/></joint>
  {"".join(joints)}
  <joint name="flange" type="fixed"><parent link="link6"/><child link="tool0"/><origin xyz="0 0 0.05"/></joint>
</robot>
"""


def gantry_mjcf() -> str:
    """Returns a gantry: slides along x, y and z, and a wrist of three hinges below them."""
    return """
<mujoco model="gantry">
  <compiler angle="radian"/>
  <worldbody>
    <body name="frame"><geom type="box" size="0.05 0.05 0.05" pos="0 0 1.1"/>
      <body name="bridge" pos="0 0 1"><joint name="x" type="slide" axis="1 0 0" range="0.1 0.8"/>
        <geom type="box" size="0.03 0.03 0.03"/>
        <body name="trolley" pos="0 0 -0.08"><joint name="y" type="slide" axis="0 1 0" range="-0.4 0.4"/>
          <geom type="box" size="0.03 0.03 0.03"/>
          <body name="mast"><joint name="z" type="slide" axis="0 0 -1" range="0 0.5"/>
            <geom type="capsule" fromto="0 0 -0.08 0 0 -0.3" size="0.025"/>
            <body name="wrist1" pos="0 0 -0.35"><joint name="w1" axis="0 0 1" range="-3 3"/>
              <geom type="capsule" fromto="0 0 0 0 0 -0.04" size="0.03"/>
              <body name="wrist2" pos="0 0 -0.08"><joint name="w2" axis="0 1 0" range="-1.5 1.5"/>
                <geom type="capsule" fromto="0 0 -0.02 0 0 -0.08" size="0.025"/>
                <body name="wrist3" pos="0 0 -0.1"><joint name="w3" axis="1 0 0" range="-1.5 1.5"/>
                  <geom type="capsule" fromto="0 0 -0.02 0 0 -0.1" size="0.02"/>
                  <site name="attachment_site" pos="0 0 -0.14" euler="3.14159265 0 0"/>
                </body>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def small_rail_mjcf() -> str:
    """Returns an arm of two hinges on a rail of 1 m along y, each link a capsule along x."""
    return """
<mujoco model="small-rail">
  <compiler angle="radian"/>
  <worldbody>
    <body name="bed"><geom type="sphere" size="0.04" pos="0 0 -0.1"/>
      <body name="carriage"><joint name="rail" type="slide" axis="0 1 0" range="-0.5 0.5"/>
        <geom type="sphere" size="0.05"/>
        <body name="upper" pos="0 0 0.1"><joint name="turn" axis="0 0 1" range="-2 2"/>
          <geom type="capsule" fromto="0.02 0 0 0.22 0 0" size="0.03"/>
          <body name="fore" pos="0.25 0 0"><joint name="lift" axis="0 1 0" range="-2 2"/>
            <geom type="capsule" fromto="0.04 0 0 0.2 0 0" size="0.025"/>
            <site name="attachment_site" pos="0.23 0 0" euler="0 1.5707963 0"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="rail" kp="1000" forcerange="-200 200"/>
  </actuator>
</mujoco>
"""
