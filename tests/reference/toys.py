"""A planar toy arm, whose clearances are easy to compute by hand, and random cells of real arms."""

import numpy as np

from mmp_env.model.arm import Arm, Obstacle, place_arm
from mmp_env.model.cell import Cell
from mmp_env.model.robot import Robot, Spheres, Tool
from mmp_env.model.transforms import matrix_from_quaternion, quaternion_from_yaw, transform

LINK_M, RADIUS_M = 1.0, 0.1


def toy_robot(**changes):
    """Returns a robot of two links of 1 m in the horizontal plane, with spheres of 0.1 m at base, elbow and tip."""
    spheres = Spheres(
        links=np.array([0, 1, 2]),
        centers=np.array([[0.0, 0, 0], [LINK_M, 0, 0], [LINK_M, 0, 0]]),
        radii=np.full(3, RADIUS_M),
    )
    fields = {
        "name": "toy",
        "title": "planar toy",
        "joint_names": ("shoulder", "elbow"),
        "link_names": ("base", "upper", "fore"),
        "origins": np.array([np.eye(4), transform(np.eye(3), [LINK_M, 0, 0])]),
        "axes": np.array([[0.0, 0, 1], [0, 0, 1]]),
        "slides": (False, False),
        "lower": np.full(2, -np.pi),
        "upper": np.full(2, np.pi),
        "velocity": np.ones(2),
        "acceleration": np.ones(2),
        "jerk": np.ones(2),
        "effort": np.ones(2),
        "draw_lower": np.full(2, -np.pi),
        "draw_upper": np.full(2, np.pi),
        "acceleration_published": False,
        "flange": transform(np.eye(3), [LINK_M, 0, 0]),
        "home": np.zeros(2),
        "tucked": np.zeros(2),
        "reach": 2 * LINK_M,
        "default_tool": None,
        "ring_spheres": "28",
        "spheres": {"28": spheres, "fine": spheres},
        "self_ignore": {key: frozenset({(0, 1), (1, 2)}) for key in ("28", "fine")},
        "mjcf": "",
    }
    return Robot(**(fields | changes))


def toy_tool(**changes):
    """Returns a tool of one sphere of 0.1 m, half a metre beyond the flange. Its centre is the tool point."""
    spheres = Spheres(links=np.array([0]), centers=np.array([[0.5, 0, 0]]), radii=np.array([RADIUS_M]))
    fields = {
        "name": "stick",
        "mount": np.eye(4),
        "point": np.array([0.5, 0, 0]),
        "spheres": {"28": spheres, "fine": spheres},
        "self_ignore": {key: frozenset({"fore"}) for key in ("28", "fine")},
        "mjcf": "",
    }
    return Tool(**(fields | changes))


def toy_arm(name, position, yaw=0.0, tool=None, **changes):
    """Returns a toy arm at a base pose."""
    return Arm(
        name=name,
        robot=toy_robot(**changes),
        tool=tool,
        position=np.array(position, dtype=float),
        quaternion=quaternion_from_yaw(yaw),
    )


def toy_cell(*arms, obstacles=()):
    """Returns a cell of toy arms."""
    return Cell(name="toys", arms=arms, obstacles=tuple(obstacles))


def solid(shape, position, quaternion=(1.0, 0, 0, 0), name="solid", **size):
    """Returns an obstacle; `size` [3], or `radius` and `length`."""
    if "size" in size:
        size["size"] = np.array(size["size"], dtype=float)
    return Obstacle(
        name=name, shape=shape, position=np.array(position, dtype=float), quaternion=np.array(quaternion), **size
    )


def random_rotation(rng):
    """Returns a quaternion (wxyz), uniform over all rotations."""
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def random_cell(rng, robots, spheres, obstacles=True):
    """Returns a cell of these robots, so close that they often touch, some tilted, among four obstacles."""
    arms = []
    for k, robot in enumerate(robots):
        angle = 2 * np.pi * k / len(robots) + rng.uniform(-0.2, 0.2)
        position = [0.2 * np.cos(angle), 0.2 * np.sin(angle), rng.uniform(-0.1, 0.1)]
        facing = quaternion_from_yaw(angle + np.pi + rng.uniform(-0.5, 0.5))
        quaternion = random_rotation(rng) if rng.random() < 0.3 else facing
        arms.append(place_arm(f"arm{k}", robot, position, quaternion))
    solids = []
    if obstacles:
        kinds = {
            "box": {"size": rng.uniform(0.05, 0.6, 3)},
            "sphere": {"radius": rng.uniform(0.05, 0.2)},
            "cylinder": {"radius": rng.uniform(0.03, 0.2), "length": rng.uniform(0.1, 0.8)},
            "capsule": {"radius": rng.uniform(0.03, 0.2), "length": rng.uniform(0.1, 0.8)},
        }
        for shape, size in kinds.items():
            place = rng.uniform([-0.9, -0.9, -0.3], [0.9, 0.9, 1.0])
            solids.append(solid(shape, place, random_rotation(rng), name=shape, **size))
    return Cell(name="random", arms=tuple(arms), obstacles=tuple(solids), spheres=spheres)


def random_configurations(rng, arm: Arm, count):
    """Returns configurations uniform in the joint limits, [count, dof]."""
    return rng.uniform(arm.robot.lower, arm.robot.upper, (count, arm.dof))


def sliding_arm(name, rng, slides, position=(0.0, 0, 0)):
    """Returns an arm of random links whose joint k slides if `slides[k]`, with two spheres of 5 cm on each link."""
    dof = len(slides)
    origins = []
    for _ in range(dof):
        turned = matrix_from_quaternion(random_rotation(rng))
        origins.append(transform(turned, rng.uniform(-0.25, 0.25, 3)))
    axes = rng.normal(size=(dof, 3))
    lower, upper = rng.uniform(-0.6, -0.1, dof), rng.uniform(0.1, 0.6, dof)
    hinges = ~np.array(slides)
    lower[hinges], upper[hinges] = -2.5, 2.5
    links = np.repeat(np.arange(dof + 1), 2)
    spheres = Spheres(links=links, centers=rng.uniform(-0.2, 0.2, (len(links), 3)), radii=np.full(len(links), 0.05))
    names = ("base", *(f"link{k + 1}" for k in range(dof)))
    robot = toy_robot(
        name="slider",
        joint_names=tuple(f"joint{k + 1}" for k in range(dof)),
        link_names=names,
        origins=np.array(origins),
        axes=axes / np.linalg.norm(axes, axis=1)[:, None],
        slides=tuple(slides),
        lower=lower,
        upper=upper,
        draw_lower=lower,
        draw_upper=upper,
        **{key: np.ones(dof) for key in ("velocity", "acceleration", "jerk", "effort")},
        flange=np.eye(4),
        home=np.zeros(dof),
        tucked=np.zeros(dof),
        spheres={"28": spheres, "fine": spheres},
        self_ignore={key: frozenset((i, j) for j in range(dof + 1) for i in range(j)) for key in ("28", "fine")},
    )
    base = {"position": np.array(position, dtype=float), "quaternion": random_rotation(rng)}
    return Arm(name=name, robot=robot, tool=None, **base)
