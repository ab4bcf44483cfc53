"""``JetHR1Step-v0``: one step of Jet-HR1, in which an agent chooses the posture at each swing point."""

from __future__ import annotations

from time import sleep
from typing import Any, Literal, get_args

import gymnasium as gym
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.utils import EzPickle
from numpy.typing import ArrayLike, NDArray

from jet_gym.balance import ThrustModel
from jet_gym.envs.physics import BulletPhysics
from jet_gym.envs.picture import Picture, Scene
from jet_gym.errors import SettingsError
from jet_gym.simulation.bullet import require_bullet
from jet_gym.simulation.disturbances import DisturbanceRanges
from jet_gym.step import Step
from jet_gym.task.lanes import POINT, POINTS, VIOLATED, Lanes
from jet_gym.task.model import RewardForm, TaskModel
from jet_gym.task.transition import Transition
from jet_gym.utils.arrays import Array
from jet_gym.utils.settings import require_within

PhysicsKind = Literal["bullet", "quasistatic"]
RenderMode = Literal["human", "rgb_array"]

_ONLY_LANE = np.zeros(1, dtype=np.int64)


class JetHR1StepEnv(gym.Env[NDArray[np.float32], NDArray[np.float32]], EzPickle):
    """A biped with a ducted fan on each foot steps over what it can't step across.

    ## Description

    Jet-HR1 is a 6.8 kg biped. While one foot swings along an arc to its landing, the other one carries the
    robot, and the fan of the swing foot carries a part of its weight. At each swing point the agent chooses
    where the pelvis goes; the pelvis is level and turned along the line from the zero-moment point (ZMP) to the
    fan, both soles are level and point forward, and so the pelvis fixes all twelve joints and the thrust that
    balances the robot. The agent is to need little thrust, to move smoothly and to violate no constraint:
    joint limits, 0 to 23 N of thrust, the edge polygon of 5 degrees, the ZMP inside the support foot.

    One episode is one step. The task is that of GAS, the posture optimiser in the paper on Jet-HR1, whose
    equation numbers are used here; lengths are in m, forces in N, angles in rad, x is forward, y left, z up.

    ## Action Space

    `Box(-1, 1, (3,), float32)`: where the pelvis goes, seen from where it is, over the search range of 0.150 m at
    the first swing point (from the nominal pelvis between the feet) and 0.025 m at the later ones. Values beyond
    the box are clipped; values that are not finite are refused.

    | Num | Action | Min | Max | Unit |
    |---|---|---|---|---|
    | 0 | displacement forward | -1 | 1 | search range |
    | 1 | displacement towards the side of the swing leg | -1 | 1 | search range |
    | 2 | displacement upward | -1 | 1 | search range |

    ## Observation Space

    `Box(float32, (31,))`, seen from the support sole and mirrored so that the swing leg is always the left one, as
    the action is. "If staying" is what the posture would be with the swing foot at the coming swing point and the
    pelvis where it is. Components are clipped to their range.

    | Num | Observation | Min | Max | Unit |
    |---|---|---|---|---|
    | 0 | progress: index of the coming swing point over that of the last | 0 | 1 | 1 |
    | 1 | 1 before the first action, which spans the wider range, else 0 | 0 | 1 | 1 |
    | 2 to 4 | pelvis x, y, z | -2 | 2 | m |
    | 5 to 7 | swing sole at the coming swing point x, y, z | -2 | 2 | m |
    | 8 to 10 | where the swing sole goes from there in one point x, y, z | -10 | 10 | 0.1 m |
    | 11 to 13 | where it goes from there in three points x, y, z | -10 | 10 | 0.1 m |
    | 14 to 16 | landing x, y, z | -2 | 2 | m |
    | 17, 18 | centre of mass if staying x, y | -2 | 2 | m |
    | 19 | thrust if staying | -3 | 3 | 23 N |
    | 20 | angle of eq. (10) if staying | -10 | 10 | 5 degrees |
    | 21 | distance from hip to ankle over the length of the straight leg if staying, swing leg | 0 | 3 | 1 |
    | 22 | the same of the support leg | 0 | 3 | 1 |
    | 23 | swing points to go | 0 | 10 | 30 points |
    | 24 | last thrust asked for | 0 | 1 | 23 N |
    | 25, 26 | from the assigned ZMP to the centre of mass if staying x, y | -20 | 20 | 0.01 m |
    | 27, 28 | from there to the line between assigned ZMP and swing ankle x, y | -20 | 20 | 0.01 m |
    | 29 | roll of the pelvis, as measured; 0 without physics | -pi | pi | rad |
    | 30 | pitch of the pelvis, as measured; 0 without physics | -pi | pi | rad |

    ## Rewards

    `reward="graded"` (default) is the sum of these terms, each zero or negative, in units of a swing point at full
    thrust. Without violation it is minus the fitness of eq. (15) over 230, that of full thrust.

    | Term | Value |
    |---|---|
    | `thrust` | minus the thrust over 23 N; with bullet what the fan delivered, on average over the interval |
    | `smoothness` | minus f3 of eq. (18), omega times the squared displacement, over 230; none at the first point |
    | `reach` | a sole is out of reach: -2, and -1 more for each 0.05 m |
    | `joint_limits` | eq. (8) fails: -2, and -1 more for each 20 degrees |
    | `thrust_limits` | eq. (9) fails: -2, and -1 more for each 23 N |
    | `edge_polygon` | eq. (10) fails: -2, and -1 more for each 0.01 m of the centre of mass outside |
    | `zmp` | eq. (11) fails: -2, and -1 more for each 0.05 m |
    | `zmp` with bullet | or the measured ZMP comes within 5 mm of the edge of what carries the robot, one sole or |
    | | the convex hull of both: down to -2 at the edge; not at the first point, reached from rest |
    | `tilt` | bullet: the pelvis tilts by more than 3 degrees: -1 for each 10 degrees beyond, -6 at the least |
    | `fall` | bullet: the robot fell: the worst of a point, -41.1, or -124.8 with `reward="fitness"`, for |
    | | this one and each that is left |

    A constraint's term is -6 at the least; `violation_cost` may be another than 2.

    `reward="fitness"` is minus f1 to f4 of eqs (16) to (22) over 230, so that the return is minus the total
    fitness of the plan over 230; with bullet f4 takes the thrust that was delivered, and `zmp`, `tilt` and `fall`
    come on top. While nothing slips or tips, the rewards of the two physics differ by less than 0.15 at each point,
    and by less than 0.3 at the first, to which the fan spins up from rest; the term `zmp` aside, in which physics
    counts what the model cannot know, such as the pelvis' acceleration.

    ## Starting State

    The robot stands with both soles on their blocks, the pelvis at its nominal place between the feet. With bullet
    it stands lower where its legs do not reach so far; the first action counts from the nominal place all the same.
    Without the argument or the option `step`, a random feasible step is drawn, distributed as
    :mod:`jet_gym.task.drawing` says: either leg, forward, sideways, diagonal or backward, unequal heights, up to
    the edge of what is feasible, bounded by `difficulty`.

    ## Episode Termination

    The episode terminates after the last swing point: a success if no constraint was violated and the robot
    stands. With bullet it also terminates if the robot falls: it tilts by more than 20 degrees, sinks, or its
    support foot leaves the carton, or the simulation explodes; that is no success. It is truncated after
    500 swing points, which only a step given by the user can have.

    ## Arguments

    `gymnasium.make("JetHR1Step-v0", physics="bullet", reward="graded", thrust_model="assigned",
    smoothness_weight=5e5, step=None, difficulty=1.0, violation_cost=2.0, time_per_point=0.2, disturbances=None,
    render_mode=None)`

    | Argument | Values | Meaning |
    |---|---|---|
    | `physics` | `"bullet"`, `"quasistatic"` | simulated by PyBullet, or the model alone |
    | `reward` | `"graded"`, `"fitness"` | see Rewards |
    | `thrust_model` | `"assigned"`, `"least"` | thrust for an assigned ZMP, or the least that balances |
    | `smoothness_weight` | float | omega of eq. (18) in 1/m^2 |
    | `step` | `jet_gym.Step` or `None` | the step of every episode, or a random one each time |
    | `difficulty` | 0 to 1 | how far random steps may go |
    | `violation_cost` | 0 to 6 | what a violated constraint costs at least in the graded reward, for curricula |
    | `time_per_point` | float | simulated time of a swing point in s; the first one takes 1.4 s, the second, with |
    | | | which the foot lifts off, 0.6 s at least |
    | `disturbances` | `jet_gym.simulation.DisturbanceRanges` or `None` | bullet: what differs from the model is |
    | | | drawn from these ranges at each reset: link masses, the pelvis' centre of mass, friction, stiffness of |
    | | | the soles, fan lag, thrust gain, the landing's height, pushes; there is no IMU here to disturb |
    | `render_mode` | `None`, `"human"`, `"rgb_array"` | PyBullet's window in real time, or frames |

    `reset(options={"step": jet_gym.Step(...)})` sets the step of one episode.

    ## Info

    | Key | Value |
    |---|---|
    | `thrust`, `fitness`, `fitness_terms` | of the model: thrust in N, fitness of eq. (15), and its f1 to f4 |
    | `reward_terms` | the terms of the reward by name |
    | `pelvis`, `joint_positions`, `com` | posture chosen: (3,), (12,) in URDF order, (3,), world frame |
    | `zmp`, `assigned_zmp` | ZMP under the thrust, and the one assigned, (2,), world frame |
    | `edge_angle` | angle of eq. (10) |
    | `violations` | names of the violated constraints |
    | `tilt`, `measured_zmp`, `measured_thrust`, `joint_torques` | bullet: as measured, (2,) and (12,); the ZMP |
    | | is the last one that the support foot had contact at |
    | `fall` | bullet: why the robot fell, or an empty string |
    | `disturbance` | with `disturbances`, from `reset`: the `jet_gym.simulation.Disturbance` that was drawn |
    | `is_success` | at the end |

    ## Version History

    * v0: first version.
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 5}  # noqa: RUF012

    def __init__(
        self,
        render_mode: RenderMode | None = None,
        *,
        physics: PhysicsKind = "bullet",
        reward: RewardForm = "graded",
        thrust_model: ThrustModel = "assigned",
        smoothness_weight: float | None = None,
        step: Step | None = None,
        difficulty: float = 1.0,
        violation_cost: float = 2.0,
        time_per_point: float = 0.2,
        disturbances: DisturbanceRanges | None = None,
    ) -> None:
        EzPickle.__init__(
            self,
            render_mode,
            physics=physics,
            reward=reward,
            thrust_model=thrust_model,
            smoothness_weight=smoothness_weight,
            step=step,
            difficulty=difficulty,
            violation_cost=violation_cost,
            time_per_point=time_per_point,
            disturbances=disturbances,
        )
        if physics not in get_args(PhysicsKind):
            raise SettingsError(f"physics must be 'bullet' or 'quasistatic', not {physics!r}")
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            raise SettingsError(f"render_mode must be None, 'human' or 'rgb_array', not {render_mode!r}")
        require_within("time_per_point", time_per_point, above=True)
        if disturbances is not None and (physics != "bullet" or not isinstance(disturbances, DisturbanceRanges)):
            raise SettingsError(
                "disturbances must be a jet_gym.simulation.DisturbanceRanges, and need bullet physics"
            )
        if physics == "bullet":
            require_bullet("gymnasium.make(..., physics='quasistatic') does without")
        self.render_mode = render_mode
        self.metadata = type(self).metadata | {"render_fps": max(1, round(1.0 / time_per_point))}
        self.model = TaskModel(reward, thrust_model, smoothness_weight, step, difficulty, violation_cost)
        self.observation_space = self.model.observation_space()
        self.action_space = self.model.action_space()
        self._physics = (
            BulletPhysics(self.model, time_per_point, window=render_mode == "human", disturbances=disturbances)
            if physics == "bullet"
            else None
        )
        self._picture: Picture | None = None
        self._lanes, self._transition = Lanes(1), Transition(1)
        self._chosen = False  # whether the transition is of this episode
        self._last_info: dict[str, Any] = {}
        self._running = False

    @property
    def current_step(self) -> Step:
        """The step of this episode."""
        if self._lanes.points[0] == 0:
            raise ResetNeeded("there is no step before the first reset()")
        return self._lanes.step_of(0, self.model.robot)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: Seed of this environment's random numbers; it goes on with them where omitted.
            options: ``{"step": jet_gym.Step(...)}``, or nothing for a random step.

        Returns:
            The observation, and an info with the disturbance that was drawn, if there is one.

        Raises:
            ValueError: If an option is wrong.
        """
        super().reset(seed=seed)
        info: dict[str, Any] = {}
        step = self.model.read_options(options) or self.model.step
        if step is None:
            self.model.drawer.draw(self._lanes, _ONLY_LANE, [self.np_random])
        else:
            self._lanes.begin(_ONLY_LANE, step)
        if self._physics is not None:
            self._lanes.attitude[0], disturbance = self._physics.reset(self.current_step, self.np_random)
            if disturbance is not None:
                info["disturbance"] = disturbance
        if self._picture is not None:
            self._picture.begin()
        self._chosen, self._last_info = False, {}
        self._running = True
        if self.render_mode == "human":
            self.render()
        return self._observe(), info

    def step(self, action: ArrayLike) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Choose the posture at one swing point.

        Args:
            action: Displacement of the pelvis (3,) over the search range, in [-1, 1].

        Returns:
            Observation, reward, terminated, truncated (never here) and info.

        Raises:
            ValueError: If the action has the wrong shape or is not finite.
            ResetNeeded: Before the first reset and after the end of an episode.
        """
        if not self._running:
            raise ResetNeeded("the episode has not begun or is over; call reset()")
        chosen = self.model.check_actions(action, (3,))
        self.model.advance(self._lanes, chosen[None], _ONLY_LANE, self._transition)
        info, numbers = self._transition.info()
        reward, info["reward_terms"] = self.model.reward_and_terms(numbers)
        lane = self._lanes.array[0]
        terminated = bool(lane[POINT] >= lane[POINTS])
        success = terminated and not lane[VIOLATED]
        if self._physics is not None:
            points_left = int(self._lanes.points[0] - self._lanes.point[0])
            point = int(self._lanes.point[0]) - 1
            outcome = self._physics.advance(self._transition, point, points_left, info["reward_terms"])
            self._lanes.attitude[0] = outcome.attitude
            info.update(outcome.info)
            info["reward_terms"] = outcome.reward_terms
            reward = float(sum(outcome.reward_terms.values()))
            terminated = terminated or outcome.fallen
            success = success and not outcome.fallen
        self._chosen, self._last_info = True, info
        if terminated:
            info["is_success"] = bool(success)
            self._running = False
        if self.render_mode == "human":
            self.render()
        return self._observe(), reward, terminated, False, info

    @property
    def violation_cost(self) -> float:
        """What a violated constraint costs at least in the graded reward; may be set, for a curriculum."""
        return self.model.violation_cost

    @violation_cost.setter
    def violation_cost(self, cost: float) -> None:
        self.model.violation_cost = cost

    def action_to(self, pelvis: ArrayLike) -> Array:
        """Return the action (3,) that moves the pelvis to a position (3,) [m], world frame.

        It is not clipped: beyond [-1, 1] the position is out of the search range.
        """
        (action,) = self.model.actions_to(self._lanes, _ONLY_LANE, np.asarray(pelvis, dtype=np.float64)[None])
        return np.asarray(action)

    def render(self) -> NDArray[np.uint8] | None:
        """Return a frame (height, width, 3), or show it in PyBullet's window.

        Raises:
            ResetNeeded: Before the first reset.
        """
        if self.render_mode is None:
            gym.logger.warn("render() needs render_mode='human' or 'rgb_array' in gymnasium.make()")
            return None
        if self._lanes.points[0] == 0:
            raise ResetNeeded("there is nothing to see before the first reset()")
        if self._picture is None:
            self._picture = Picture(self.model, self._physics, window=self.render_mode == "human")
        info = self._last_info
        scene = Scene(
            step=self.current_step,
            point=int(self._lanes.point[0]) - 1,
            transition=self._transition if self._chosen else None,
            zmp=info.get("measured_zmp", info.get("zmp")),
            thrust=float(info.get("measured_thrust", info.get("thrust", 0.0))),
        )
        frame = self._picture.frame(scene)
        if frame is None and self._physics is None:
            sleep(1.0 / self.metadata["render_fps"])
        return frame

    def close(self) -> None:
        """Close simulation and window; again is no error."""
        for owner in (self._picture, self._physics):
            if owner is not None:
                owner.close()
        self._running = False
        self._lanes.points[0] = 0

    def _observe(self) -> NDArray[np.float32]:
        observations = self.model.empty_observations(1)
        self.model.observe(self._lanes, _ONLY_LANE, observations)
        observation: NDArray[np.float32] = observations[0]
        return observation
