"""Descriptions of small arms, made for tests: URDF and MJCF of primitive geoms, and small meshes."""

import numpy as np

BALL = '<geometry><sphere radius="0.05"/></geometry>'


def urdf(*, joints="", links="", limit='<limit lower="-1.5" upper="1.5" effort="20" velocity="1.2"/>', shape=BALL):
    """An arm of three hinges, each link a ball; more `joints` and `links`, another `limit` of the second joint."""
    return f"""<?xml version="1.0"?>
<robot name="small">
  <link name="world"/>
  <link name="base_link"><collision>{BALL}</collision></link>
  <link name="upper"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>
    </inertial><collision><origin xyz="0 0 0.1"/>{shape}</collision></link>
  <link name="fore"><collision><origin xyz="0.12 0 0"/>{BALL}</collision></link>
  <link name="hand"><visual><geometry><mesh filename="package://nowhere/looks.dae"/></geometry></visual>
    <collision><origin xyz="0.1 0 0"/>{BALL}</collision></link>
  <link name="tool0"/>
  {links}
  <joint name="mount" type="fixed"><parent link="world"/><child link="base_link"/></joint>
  <joint name="turn" type="revolute"><parent link="base_link"/><child link="upper"/><origin xyz="0 0 0.1"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="30" velocity="1.5"/></joint>
  <joint name="lift" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0 0 0.25" rpy="0.3 0 0"/>
    <axis xyz="0 1 0"/>{limit}</joint>
  <joint name="roll" type="continuous"><parent link="fore"/><child link="hand"/><origin xyz="0.25 0 0"/>
    <axis xyz="0 0 1"/></joint>
  <joint name="flange" type="fixed"><parent link="hand"/><child link="tool0"/><origin xyz="0.15 0 0"/></joint>
  {joints}
</robot>
"""


def mjcf(
    *, asset="", base="", hand="", after="", geom='type="sphere" size="0.05"', joint2='type="hinge" range="-90 90"'
):
    """An arm of three joints; `asset`, children of `base` and `hand`, elements `after` the bodies, one more `geom`."""
    return f"""
<mujoco model="small">
  <asset>{asset}</asset>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body name="base"><geom type="sphere" size="0.06"/>{base}
      <body name="upper" pos="0 0 0.15"><joint name="a1" axis="0 0 1" range="-120 120"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.1" size="0.04"/>
        <body name="fore" pos="0 0 0.2"><joint name="a2" axis="0 1 0" {joint2}/>
          <geom {geom} pos="0.12 0 0"/>
          <body name="hand" pos="0.22 0 0"><joint name="a3" axis="1 0 0" range="-100 100"/>
            <geom type="sphere" size="0.03" pos="0.05 0 0"/>
            <geom type="sphere" size="0.2" contype="0" conaffinity="0"/>
            <site name="attachment_site" pos="0.1 0 0"/>{hand}
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  {after}
</mujoco>
"""


def fingers(count=2):
    """Bodies with a slide joint each, for the hand."""
    return "".join(
        f'<body name="finger{k}" pos="0.1 {0.03 * k} 0"><joint name="finger_joint{k}" type="slide" axis="0 1 0"'
        f' range="0 0.04"/><geom type="box" size="0.02 0.005 0.005"/></body>'
        for k in range(count)
    )


def box_mesh(size=(0.1, 0.08, 0.06)):
    """Vertices and outward triangles of a box."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.array(size) / 2
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
    faces += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    return corners, np.array(faces)


def write_obj(path, vertices, faces):
    """The path, with the mesh there as OBJ."""
    lines = [f"v {x} {y} {z}" for x, y, z in vertices] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    path.write_text("\n".join(lines) + "\n")
    return path


def with_mesh(path, vertices, faces, scale="1 1 1"):
    """The path, with an MJCF arm there whose second link is that mesh."""
    write_obj(path.parent / "link.obj", vertices, faces)
    asset = f'<mesh name="link" file="link.obj" scale="{scale}"/>'
    path.write_text(mjcf(asset=asset, geom='type="mesh" mesh="link"'))
    return path
