"""The Gymnasium environment `MultiArmCell-*`: a crowded cell of robot arms, which also executes plans.

docs/reference/environment.md describes the spaces, the reward and the constants.
"""

from __future__ import annotations

import copy
import inspect
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from itertools import pairwise
from os import PathLike
from typing import Any

import gymnasium
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mmp_env.argument_checks import as_numbers, given, refused, whole
from mmp_env.errors import MmpError, UnknownNameError, UnretimedPlanWarning
from mmp_env.files.cell_source import cell_names, find_cell
from mmp_env.gym.cell_instance import CellInstance, InstanceSource, Margin
from mmp_env.gym.control import CONTROL_RATE_HZ, ControlMode, checked_action, checked_actions, steps_per_action
from mmp_env.gym.environment_options import check_options
from mmp_env.gym.instances import DEFAULT_TASK
from mmp_env.gym.observation import joint_limits
from mmp_env.gym.registration import ANY_CELL
from mmp_env.gym.reward import Distance, GoalProgress, measured
from mmp_env.gym.thread_guard import ThreadGuard, one_thread_at_a_time
from mmp_env.gym.world_events import GivenEvents, WorldEvents, observer
from mmp_env.model.arm import Obstacle
from mmp_env.model.cell import Cell
from mmp_env.model.plan import Plan
from mmp_env.model.plan_fit import check_fit, given_plan
from mmp_env.model.problem import DEFAULT_MAX_VELOCITY, Problem, keeps_margins
from mmp_env.model.task import State, Task
from mmp_env.opengl import check_render_mode, possible_render_modes
from mmp_env.sim.cart_simulation import CartSimulation
from mmp_env.sim.contacts import Contact
from mmp_env.sim.execution import SHOWN_STEPS, ExecutionReport, execute_plan
from mmp_env.sim.monitor import Monitor
from mmp_env.sim.rendering import Camera, Window

Observation = dict[str, np.ndarray]
_UNRETIMED = (
    "the plan is not retimed: it changes velocity instantly at its corners, which no motor can follow; execute"
    " mmp_env.retime.retime(plan) instead (mmp plan does so unless --no-retime is given)"
)


class MultiArmCellEnv(gymnasium.Env[Any, np.ndarray]):
    """All arms of a cell move from a start to a goal configuration without touching each other or the obstacles.

    One thread at a time can use an environment: the methods that a second thread calls meanwhile raise `MmpError`.

    Args:
        cell: a `Cell`, the name of a ring, or the path of a cell or instance file.
        robot: the robot of a ring, as in `find_cell`.
        task: the task that draws the instances, or its name.
        spheres: the sphere set, as in `find_cell`.
        control_mode: the meaning of an action, `position`, `velocity` or `delta`.
        terminate_on_contact: whether a contact ends the episode.
        self_contacts: whether an arm that touches itself is a contact.
        max_velocity: largest velocity of actions and problems [rad/s].
        margin: margin of `problem`, in the forms that `make_problem` takes. `reset` refuses an instance whose start or
            goal is closer.
        control_rate_hz: actions per second of simulated time.
        events: what happens while the arms move: `cart`, `goals` or both, or a dict name -> options.
        render_mode: `human`, `rgb_array` or None.
        width: width of pictures in pixels.
        height: height of pictures in pixels.

    Raises:
        MmpError: for an unknown option or a bad value.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - Gymnasium has it as an attribute of class and instance
        "render_modes": ["human", "rgb_array"],
        "render_fps": CONTROL_RATE_HZ,
    }

    def __init__(
        self,
        *,
        cell: Cell | str | PathLike[str] | None = None,
        robot: str | None = None,
        task: str | Task = DEFAULT_TASK,
        spheres: str | int | None = None,
        control_mode: str = "position",
        terminate_on_contact: bool = True,
        self_contacts: bool = True,
        max_velocity: float = DEFAULT_MAX_VELOCITY,
        margin: Margin = None,
        control_rate_hz: int = CONTROL_RATE_HZ,
        events: GivenEvents = None,
        render_mode: str | None = None,
        width: int = 640,
        height: int = 480,
        **unknown: Any,
    ) -> None:
        for option in unknown:
            raise UnknownNameError("option of MultiArmCell", option, _OPTIONS)
        if cell is None:
            raise MmpError(f"MultiArmCell needs cell=, a Cell, a file or one of {', '.join(cell_names())}")
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise UnknownNameError("render_mode", render_mode, self.metadata["render_modes"])
        check_render_mode(render_mode)
        check_options(
            {
                "robot": robot,
                "spheres": spheres,
                "control_mode": control_mode,
                "terminate_on_contact": terminate_on_contact,
                "self_contacts": self_contacts,
                "control_rate_hz": control_rate_hz,
                "width": width,
                "height": height,
            }
        )
        # The class has all modes, an environment those that work on this machine.
        possible = possible_render_modes(self.metadata["render_modes"])
        self.metadata = {"render_modes": possible, "render_fps": control_rate_hz}
        bare = find_cell(cell, robot=robot, spheres=None if spheres is None else str(spheres))
        self.render_mode = render_mode
        self._source = InstanceSource(bare, task, max_velocity, margin)
        self._terminate_on_contact = terminate_on_contact
        lower, upper = joint_limits(bare)
        self._self_contacts = self_contacts
        self._events = WorldEvents(events)
        self._simulation = self._events.simulation(bare, self_contacts=self_contacts)
        self._steps = steps_per_action(control_rate_hz, self._simulation.timestep_s)
        reach = self._source.fastest / control_rate_hz
        self._mode = ControlMode(name=control_mode, lower=lower, upper=upper, reach=reach)
        self._observer = observer(self._simulation)
        self.observation_space = self._observer.space
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (self._simulation.count,), np.float32)
        self._instance: CellInstance | None = None
        self._picture_size = (width, height)
        self._view: Camera | Window | None = None
        self.thread_guard = ThreadGuard()

    @one_thread_at_a_time
    def __getstate__(self) -> dict[str, Any]:
        # A window or renderer belongs to its process. A copy opens its own at its first render().
        return {**vars(self), "_view": None}

    @one_thread_at_a_time
    def __deepcopy__(self, memo: dict[int, Any]) -> MultiArmCellEnv:
        # Cells are immutable, and compiling their queries takes longer than copying everything else.
        memo |= {id(cell): cell for cell in (self._source.cell, self.cell)}
        other = memo[id(self)] = copy.copy(self)
        vars(other).update(copy.deepcopy(self.__getstate__(), memo))
        return other

    @property
    def cell(self) -> Cell:
        """The cell of the present instance, with the objects of its task."""
        return self._simulation.cell

    @property
    def model(self) -> Any:
        """The `mujoco.MjModel` of the cell."""
        return self._simulation.model

    @property
    def data(self) -> Any:
        """The `mujoco.MjData` that the environment steps."""
        return self._simulation.data

    @property
    def problem(self) -> Problem:
        """The present instance as a problem. Raises `ResetNeeded`, or `InvalidInstanceError` for a bad task."""
        return self._present().problem

    @property
    def goal(self) -> State:
        """Arm name -> the present goal [dof] [rad], which the event `goals` changes. Raises `ResetNeeded`."""
        return self._present().goal

    @property
    def cart(self) -> Obstacle:
        """The cart of the event `cart` where it is now, with its largest speed.

        Raises:
            MmpError: if the environment has no cart.
        """
        if not isinstance(self._simulation, CartSimulation):
            raise MmpError("the environment has no cart; make it with events='cart'")
        return self._simulation.cart.obstacle()

    @one_thread_at_a_time
    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Puts the arms at rest at the start of the next instance.

        Args:
            seed: a whole number from 0 that starts the stream of instances; None continues the stream.
            options: a dict with `start`, `goal`, both or neither, arm name -> a configuration [dof] [rad], a
                `PoseGoal` or another goal that `make_problem` takes, also in the form of JSON. An arm that `goal`
                leaves out stays. The task draws a missing start or goal. With both, the cell has no objects of it.

        Returns:
            Observation and info.

        Raises:
            MmpError: for a bad seed, or options of the wrong form.
            InvalidInstanceError: if start or goal is out of reach or limits, in collision, or closer than `margin`.
        """
        asked = self._source.asked({} if options is None else options)
        super().reset(seed=None if seed is None else whole("seed", seed, 0))
        instance = self._source.following(asked, self.np_random, self._label(seed))
        self._events.check(instance, self._source)
        self._enter(instance.cell)
        self._instance = instance
        self._events.begin(self.np_random, self._simulation)
        self._simulation.place(self._simulation.joined(instance.start))
        self._stand()
        self._show_window()
        return self._observation(), {**self._info([]), **self._events.info()}

    @one_thread_at_a_time
    def step(self, action: np.ndarray) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Moves the arms for one control period.

        Args:
            action: [n] numbers in [-1, 1]; the control mode gives them their meaning.

        Returns:
            Observation, reward, terminated, truncated (always False here), and info.

        Raises:
            MmpError: for an action of the wrong shape, or with numbers that are not finite.
        """
        self._present()
        progress, seen = self._progress, np.empty(self._observer.size)
        begin, end = self._mode.reference(
            checked_action(action, self._simulation.count), progress.q, progress.reference
        )
        for _ in self._drive(begin, end, seen):
            pass
        q = self._observer.positions(seen)
        reward, over, info = self._arrive(q, end, measured(q, progress.target))
        return self._observer.observation(seen, progress.target), reward, over, False, info

    @classmethod
    def step_together(
        cls, envs: Sequence[MultiArmCellEnv], actions: np.ndarray, run: Callable[[list[Iterator[None]]], None]
    ) -> tuple[Observation, list[float], list[bool], list[dict[str, Any]]]:
        """Steps several environments that were made with the same options, each as `step` does.

        Args:
            envs: the environments, at least one.
            actions: an action of each [m, n].
            run: goes through all iterators of a list, perhaps in threads.

        Returns:
            Observations as arrays of m rows; reward, whether the episode is over, and info of each environment.

        Raises:
            MmpError: like `step`.
        """
        with ExitStack() as guards:
            for env in envs:
                guards.enter_context(env.thread_guard)
            first, count = envs[0], envs[0]._simulation.count
            for env in envs:
                env._present()
            seen = np.empty((len(envs), first._observer.size))
            before = [
                np.array(rows)
                for rows in zip(*((env._progress.q, env._progress.reference) for env in envs), strict=True)
            ]
            begin, end = first._mode.reference(checked_actions(actions, count), *before)
            run([env._drive(*each) for env, *each in zip(envs, begin, end, seen, strict=True)])
            q = first._observer.positions(seen)
            distances = zip(*measured(q, np.array([env._progress.target for env in envs])), strict=True)
            arrived = [
                env._arrive(its_q, its_end, distance)
                for env, its_q, its_end, distance in zip(envs, q, end, distances, strict=True)
            ]
            goals = np.array([env._progress.target for env in envs])
            rewards, over, infos = map(list, zip(*arrived, strict=True))
            return first._observer.observation(seen, goals), rewards, over, infos

    @one_thread_at_a_time
    def action_towards(self, q: ArrayLike) -> np.ndarray:
        """Returns the action [n] that moves the reference of the servos to a configuration, or as near as possible.

        Args:
            q: configuration of all joints [n] [rad], arm after arm.

        Raises:
            MmpError: for another number of joints, or numbers that are not finite.
        """
        self._present()
        wanted, progress = as_numbers(q), self._progress
        if wanted is None or wanted.shape != progress.q.shape or not np.isfinite(wanted).all():
            raise refused("the configuration", q, f"{len(progress.q)} finite numbers")
        return self._mode.action(wanted, self._simulation.positions, progress.reference).astype(np.float32)

    @one_thread_at_a_time
    def execute(self, plan: Plan | None, *, monitor: Monitor | None = None) -> ExecutionReport:
        """Plays a plan through the actuators, see `execute_plan`. The arms stay where the plan ends.

        The start, goal and margins of the plan become those of the environment. A plan that moves and is not retimed
        causes an `UnretimedPlanWarning`.

        Args:
            plan: a plan for arms of this cell. None, the result of a failed planner, is an error.
            monitor: stops all arms of a retimed plan while one of them lags.

        Returns:
            The report of the execution.

        Raises:
            MmpError: for None, or a plan of another cell.
        """
        plan = given_plan(plan, "execute")
        if monitor is not None:
            given("monitor", monitor, Monitor, "a Monitor, such as mmp_env.Monitor(), or None")
        check_fit(plan, self.cell)
        if plan.steps_in_velocity:
            warnings.warn(_UNRETIMED, UnretimedPlanWarning, stacklevel=3)  # the guard is between
        # Arms that the cell of the plan does not have stay where they are, and this is also their goal.
        here, problem = self._simulation.split(self._simulation.positions), plan.problem
        start, goal = {**here, **problem.start}, {**here, **problem.goal}
        margin = problem.margins if keeps_margins(self.cell, (start, goal), problem.margins) else None
        self._instance = self._source.instance(self.cell, start, goal, name=problem.name, margin=margin)
        report = execute_plan(self._simulation, plan, self._show_window, monitor)
        self._stand()
        return report

    @one_thread_at_a_time
    def render(self) -> np.ndarray | None:
        """Returns a picture [height, width, 3] of bytes with the goals as ghosts, or updates the window of `human`."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() without a render_mode shows nothing; give one to gymnasium.make")
            return None
        return self._draw()

    @one_thread_at_a_time
    def close(self) -> None:
        """Closes window and renderer. The environment can still be used."""
        if self._view is not None:
            self._view.close()
            self._view = None

    def _enter(self, cell: Cell) -> None:
        """Makes this the cell of the environment, with a new simulation unless it is the cell already."""
        if cell is self.cell:
            return
        self.close()
        self._simulation = self._events.simulation(cell, self_contacts=self._self_contacts)
        self._observer = observer(self._simulation)

    def _draw(self) -> np.ndarray | None:
        if self._view is None:
            kind = Window if self.render_mode == "human" else Camera
            self._view = kind(self._simulation, *self._picture_size)
        return self._view.show(self._simulation.joined(self._present().goal))

    def _present(self) -> CellInstance:
        if self._instance is None:
            raise gymnasium.error.ResetNeeded("there is no instance yet; call reset() first")
        return self._instance

    def _stand(self) -> None:
        """Begins references and progress at the present joint positions."""
        self._progress = GoalProgress(self._simulation.positions, self._simulation.joined(self._present().goal))

    def _label(self, seed: int | None) -> str:
        """Returns the name of a drawn instance, `<environment id or cell>/<seed>`; empty without a seed."""
        if seed is None:
            return ""
        source = self._source.cell.name if self.spec is None or self.spec.id == ANY_CELL else self.spec.id
        return f"{source}/{seed}"

    def _drive(
        self, begin: Float[np.ndarray, "n"], end: Float[np.ndarray, "n"], seen: Float[np.ndarray, "size"]
    ) -> Iterator[None]:
        """Moves the arms along a reference for one control period, and reads into `seen` what is observed then.

        Pauses now and then, so that another thread can go on.
        """
        self._simulation.log.clear()
        yield from self._move(begin, end)
        self._observer.look(seen)

    def _arrive(
        self, q: Float[np.ndarray, "n"], end: Float[np.ndarray, "n"], distance: Distance
    ) -> tuple[float, bool, dict[str, Any]]:
        """Returns reward, whether the episode is over, and info of a control period that has ended at `q` [rad]."""
        contacts = self._simulation.log.contacts
        reward = self._progress.update(q, end, distance=distance, contact=bool(contacts))
        info = self._info(contacts)
        over = (info["is_success"] and self._events.ends_at_goal) or (self._terminate_on_contact and bool(contacts))
        self._renew_goal(reached=info["is_success"])
        return reward, over, {**info, **self._events.info()}

    def _renew_goal(self, *, reached: bool) -> None:
        """Takes over the goals that the events give after a step, if any."""
        if self._events.ends_at_goal:
            return
        here = self._simulation.split(self._progress.q)
        period_s = self._steps * self._simulation.timestep_s
        instance = self._events.next_instance(self._source, here, period_s, reached=reached)
        if instance is not None:
            self._instance = instance
            self._progress.aim(self._simulation.joined(instance.goal))

    def _observation(self) -> Observation:
        return self._observer.observe(self._progress.target)

    def _info(self, contacts: list[Contact]) -> dict[str, Any]:
        progress = self._progress
        return {"is_success": progress.is_success, "contacts": contacts, "distance_rad": progress.distance_rad}

    def _move(self, begin: Float[np.ndarray, "n"], end: Float[np.ndarray, "n"]) -> Iterator[None]:
        """Moves the arms for one control period, in several parts if a window shows the motion."""
        if self.render_mode != "human":
            yield from self._simulation.ramp_in_parts(begin, end, self._steps)
            return
        count = -(-self._steps // SHOWN_STEPS)
        for first, last in pairwise(round(k * self._steps / count) for k in range(count + 1)):
            here, there = (begin + mark / self._steps * (end - begin) for mark in (first, last))
            yield from self._simulation.ramp_in_parts(here, there, last - first)
            self._draw()  # perhaps in a helping thread of a batch, whose caller has the guard

    def _show_window(self) -> None:
        if self.render_mode == "human":
            self._draw()


_OPTIONS = tuple(name for name, p in inspect.signature(MultiArmCellEnv).parameters.items() if p.kind is p.KEYWORD_ONLY)
