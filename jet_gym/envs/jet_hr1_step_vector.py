"""``JetHR1Step-v0`` as one batch: the quasi-static environment, thousands of episodes side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.utils.seeding import np_random as seeded_generator
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from jet_gym.envs.registration import MAX_EPISODE_STEPS
from jet_gym.step import Step
from jet_gym.task.drawing import Drawer
from jet_gym.task.lanes import Lanes
from jet_gym.task.model import TaskModel
from jet_gym.task.transition import Transition
from jet_gym.utils.threads import available_cores

_LANES_PER_THREAD = 512

Observations = NDArray[np.float32]
Rewards = NDArray[np.float64]
Flags = NDArray[np.bool_]


class JetHR1StepVectorEnv(VectorEnv[Observations, NDArray[np.float32], NDArray[Any]]):
    """Many quasi-static ``JetHR1Step-v0`` environments in one, lane by lane equal to as many single ones.

    ``gymnasium.make_vec("JetHR1Step-v0", num_envs=4096, vectorization_mode="vector_entry_point")``. Spaces,
    reward and info are those of :class:`~jet_gym.envs.jet_hr1_step.JetHR1StepEnv` with
    ``physics="quasistatic"``, batched as Gymnasium batches them. A lane that ends is reset in the same step:
    ``final_obs`` and ``final_info`` hold what it ended with (``AutoresetMode.SAME_STEP``); with
    ``autoreset_mode="NextStep"`` its next step resets it, and with ``"Disabled"`` the caller does, through
    ``options={"reset_mask": ...}``.

    Args:
        num_envs: Number of lanes.
        max_episode_steps: A lane is truncated after as many steps.
        physics: ``"quasistatic"``, the only one that comes in a batch.
        autoreset_mode: When a lane that ended is reset.
        threads: Threads among which the lanes are divided; as many as are worth it where omitted.
        render_mode: ``None``; a batch has no picture.
        **task: Arguments of the single environment: ``reward``, ``thrust_model``, ``smoothness_weight``,
            ``step``, ``difficulty``, ``violation_cost``.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012

    def __init__(
        self,
        num_envs: int = 1,
        *,
        max_episode_steps: int = MAX_EPISODE_STEPS,
        physics: str = "quasistatic",
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        threads: int | None = None,
        render_mode: None = None,
        **task: Any,
    ) -> None:
        if physics != "quasistatic":
            raise ValueError(
                f"the batch is quasi-static; for physics={physics!r} use vectorization_mode='sync' or 'async'"
            )
        if num_envs < 1 or max_episode_steps < 1:
            raise ValueError(
                f"num_envs and max_episode_steps must be 1 at least, not {num_envs} and {max_episode_steps}"
            )
        if threads is not None and threads < 1:
            raise ValueError(f"threads must be 1 at least, not {threads}")
        if render_mode is not None:
            raise ValueError("a batch has no picture; render a single environment")
        self._model = TaskModel(**task)
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = type(self).metadata | {"autoreset_mode": self.autoreset_mode}
        self.num_envs = num_envs
        self.single_observation_space = self._model.observation_space()
        self.single_action_space = self._model.action_space()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.render_mode = None
        self._max_episode_steps = max_episode_steps
        self._lanes, self._transition = Lanes(num_envs), Transition(num_envs)
        self._elapsed = np.zeros(num_envs, dtype=np.int64)
        self._over = np.ones(num_envs, dtype=np.bool_)  # lanes that wait for their reset
        self._generators: list[np.random.Generator] = [seeded_generator(None)[0] for _ in range(num_envs)]
        wanted = threads if threads is not None else min(available_cores(), num_envs // _LANES_PER_THREAD)
        self._shares = np.array_split(np.arange(num_envs), max(1, wanted))
        self._pool: ThreadPoolExecutor | None = None
        self._reset_once = False

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Begin a step in every lane, or in those of ``options["reset_mask"]``.

        Args:
            seed: Seed of lane i is ``seed + i``, or one a lane; a lane without one goes on with its generator.
            options: ``{"step": Step}`` for all lanes, ``{"reset_mask": (num_envs,) bool}``.

        Returns:
            Observations (num_envs, ...) and an empty info.

        Raises:
            ValueError: If seeds or options are wrong.
        """
        seeds = self._seeds(seed)
        if options is not None and not isinstance(options, dict):
            raise ValueError(f"options must be a table, not {options!r}")
        options = dict(options or {})
        mask = self._reset_mask(options.pop("reset_mask", None))
        step = self._model.read_options(options)
        if not self._reset_once and not mask.all():
            raise ResetNeeded("the first reset must be of all lanes")
        for lane in np.flatnonzero(mask).tolist():
            if seeds[lane] is not None:
                self._generators[lane] = seeded_generator(seeds[lane])[0]
        self._begin(np.flatnonzero(mask), step)
        self._reset_once = True
        observations = self._model.empty_observations(self.num_envs)
        self._model.observe(self._lanes, np.arange(self.num_envs), observations)
        return observations, {}

    def step(self, actions: NDArray[np.float32]) -> tuple[Observations, Rewards, Flags, Flags, dict[str, Any]]:
        """Choose a posture in every lane.

        Args:
            actions: Displacements of the pelvis (num_envs, 3), each in [-1, 1]; beyond that they are clipped.

        Returns:
            Observations, rewards, terminations, truncations and infos, one a lane.

        Raises:
            ValueError: If the actions have the wrong shape or are not finite.
            ResetNeeded: Before the first reset, and with autoreset disabled for lanes that ended.
        """
        if not self._reset_once:
            raise ResetNeeded("call reset() before step()")
        if self.autoreset_mode == AutoresetMode.DISABLED and self._over.any():
            raise ResetNeeded(f"lanes {np.flatnonzero(self._over)[:8].tolist()} ended; reset them by reset_mask")
        chosen = self._model.check_actions(actions, (self.num_envs, 3))
        waiting = np.flatnonzero(self._over)  # NEXT_STEP: these lanes only begin anew
        self._elapsed += 1
        terminations = self._lanes.point + 1.0 >= self._lanes.points
        truncations = (self._elapsed >= self._max_episode_steps) & ~terminations
        terminations[waiting], truncations[waiting] = False, False
        over = terminations | truncations
        ending = np.flatnonzero(over)
        same_step = self.autoreset_mode == AutoresetMode.SAME_STEP
        observations = self._model.empty_observations(self.num_envs)
        final, success = np.empty((len(ending), observations.shape[1]), np.float32), np.zeros_like(over)

        def advance(share: NDArray[np.int64]) -> None:
            self._model.advance(self._lanes, chosen, share, self._transition)
            ends = _part(ending, share)
            success[ending[ends]] = self._lanes.violated[ending[ends]] == 0.0
            if same_step:
                self._model.observe(self._lanes, share, observations)
                final[ends] = observations[ending[ends]]
                share = ending[ends]
            self._begin(share if same_step else waiting[_part(waiting, share)], None)
            self._model.observe(self._lanes, share, observations)

        self._in_threads(advance)
        rewards = self._model.rewards(self._transition)
        rewards[waiting] = 0.0
        infos = self._infos(ending, waiting, terminations, success)
        if same_step and len(ending):
            infos["final_obs"], infos["_final_obs"] = _as_objects(final, ending, self.num_envs), over.copy()
        elif not same_step:
            self._over = over
        return observations, rewards, terminations, truncations, infos

    @property
    def violation_cost(self) -> float:
        """What a violated constraint costs at least in the graded reward; may be set, for a curriculum."""
        return self._model.violation_cost

    @violation_cost.setter
    def violation_cost(self, cost: float) -> None:
        self._model.violation_cost = cost

    @property
    def drawer(self) -> Drawer:
        """What draws the steps; may be replaced, for a curriculum."""
        return self._model.drawer

    @drawer.setter
    def drawer(self, drawer: Drawer) -> None:
        self._model.drawer = drawer

    def close_extras(self, **_: Any) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None

    @property
    def np_random_seed(self) -> Any:
        """Seeds of the lanes' generators are not kept; Gymnasium asks for -1 then."""
        return (-1,) * self.num_envs

    def _seeds(self, seed: int | Sequence[int | None] | None) -> Sequence[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int | np.integer):
            return [int(seed) + lane for lane in range(self.num_envs)]
        if not isinstance(seed, list | tuple | np.ndarray):
            raise ValueError(f"seed must be a whole number or a list of them, not {seed!r}")  # noqa: TRY004
        if len(seed) != self.num_envs:
            raise ValueError(f"seed must be one number or {self.num_envs} of them, not {len(seed)}")
        return seed

    def _reset_mask(self, mask: Any) -> Flags:
        if mask is None:
            return np.ones(self.num_envs, dtype=np.bool_)
        if not isinstance(mask, np.ndarray) or mask.shape != (self.num_envs,) or mask.dtype != np.bool_:
            raise ValueError(f"options['reset_mask'] must be a bool array of shape ({self.num_envs},)")
        if not mask.any():
            raise ValueError("options['reset_mask'] must select a lane")
        return mask

    def _begin(self, selected: NDArray[np.int64], step: Step | None) -> None:
        """Begin a step in the selected lanes: the given one, the one of the constructor, or a random one."""
        if len(selected) == 0:
            return
        step = step or self._model.step
        if step is None:
            self._model.drawer.draw(self._lanes, selected, [self._generators[lane] for lane in selected.tolist()])
        else:
            self._lanes.begin(selected, step)
        self._elapsed[selected], self._over[selected] = 0, False

    def _infos(
        self, ending: NDArray[np.int64], waiting: NDArray[np.int64], terminations: Flags, success: Flags
    ) -> dict[str, Any]:
        """Return the infos of all lanes; those of lanes that are reset in this step go to ``final_info``.

        They are packed as Gymnasium does: what is not there is zero or ``None``, and a mask tells what is.
        """
        if len(waiting) == self.num_envs:
            return {}
        successes = {"is_success": success & terminations}
        successes = _with_masks(successes, terminations.copy()) if terminations.any() else {}
        if self.autoreset_mode != AutoresetMode.SAME_STEP:
            self._transition.take(waiting)
            return self._values(self._transition, _mask(waiting, self.num_envs, invert=True)) | successes
        if len(ending) == 0:
            return self._values(self._transition, np.ones(self.num_envs, dtype=np.bool_))
        ended = _mask(ending, self.num_envs)
        final = self._values(self._transition.take(ending), ended) | successes
        going_on = self._values(self._transition, ~ended) if len(ending) < self.num_envs else {}
        return going_on | {"final_info": final, "_final_info": ended.copy()}

    def _values(self, transition: Transition, present: Flags) -> dict[str, Any]:
        values = transition.infos(present)
        terms = self._model.reward_terms(transition)
        values["reward_terms"] = dict(zip(self._model.reward_names, terms, strict=True))
        return _with_masks(values, present)

    def _in_threads(self, work: Callable[[NDArray[np.int64]], None]) -> None:
        """Do work on shares of the lanes side by side.

        At first the caller does its share alone: Ctrl-C ends what compiles there, and would wait for a thread.
        """
        mine, *others = self._shares
        if not others:
            work(mine)
            return
        first = self._pool is None
        if self._pool is None:
            work(mine)
            self._pool = ThreadPoolExecutor(len(others), thread_name_prefix="jet_gym")
        results = [self._pool.submit(work, share) for share in others]
        if not first:
            work(mine)
        for result in results:
            result.result()


def _part(selected: NDArray[np.int64], share: NDArray[np.int64]) -> slice:
    """Return where the ascending selected lanes are of a share of consecutive lanes."""
    first, last = np.searchsorted(selected, (share[0], share[-1] + 1))
    return slice(first, last)


def _mask(selected: NDArray[np.int64], count: int, *, invert: bool = False) -> Flags:
    mask = np.full(count, invert)
    mask[selected] = not invert
    return mask


def _with_masks(values: dict[str, Any], present: Flags) -> dict[str, Any]:
    """Return values, each with the mask of the lanes that it is there for."""
    infos: dict[str, Any] = {}
    for name, value in values.items():
        infos[name] = _with_masks(value, present) if isinstance(value, dict) else value
        infos[f"_{name}"] = present
    return infos


def _as_objects(observations: Observations, selected: NDArray[np.int64], count: int) -> NDArray[Any]:
    """Return the selected lanes' observations as Gymnasium packs them: objects, ``None`` where there is none."""
    packed = np.full(count, None)
    for lane, observation in zip(selected.tolist(), observations, strict=True):
        packed[lane] = observation
    return packed
