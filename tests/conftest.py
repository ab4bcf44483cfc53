"""What the tests share: the robot, seeded random numbers, and two other libraries as oracles of its kinematics."""

from __future__ import annotations

import importlib
import importlib.util
import os
import shutil
import signal
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import hypothesis
import numpy as np
import pytest

from agents import Plan, make_planner
from jet_gym import Robot, jet_hr1
from jet_gym.courses import PAPER
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from jet_gym.simulation import World
    from jet_gym.simulation.trials import Experiment

hypothesis.settings.register_profile("jet_gym", deadline=None, derandomize=True, max_examples=100)
hypothesis.settings.register_profile(  # for make mutate, where a failing example need not become small
    "mutants",
    hypothesis.settings.get_profile("jet_gym"),
    phases=[hypothesis.Phase.explicit, hypothesis.Phase.generate],
)
hypothesis.settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "jet_gym"))

FUZZ = int(os.environ.get("JET_GYM_FUZZ", "1"))
"""How many times as many examples the fuzz tests try, and others each time if it is more than 1: ``make fuzz``."""


def fuzz_settings(examples: int) -> hypothesis.settings:
    """Return the settings of a fuzz test that tries so many examples in the suite."""
    health = hypothesis.HealthCheck
    return hypothesis.settings(
        max_examples=examples * FUZZ,
        derandomize=FUZZ == 1,
        deadline=None,
        suppress_health_check=[health.function_scoped_fixture, health.too_slow, health.data_too_large],
    )


if importlib.util.find_spec("stable_baselines3") is None:  # the base install, without the extra [train]
    collect_ignore = ["test_imitation.py", "test_replay.py", "test_training.py", "test_vec_env.py"]

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # run in the background, where commands would not hear Ctrl-C
    signal.signal(signal.SIGINT, signal.default_int_handler)


@dataclass(frozen=True, eq=False)
class PinocchioRobot:
    """A URDF placed by pinocchio, its root at the origin."""

    model: Any
    data: Any
    joint_names: tuple[str, ...]

    def place(self, joint_positions: Array) -> None:
        """Move the joints to positions in the order of ``joint_names``."""
        pin = importlib.import_module("pinocchio")
        q = pin.neutral(self.model)
        for name, position in zip(self.joint_names, joint_positions, strict=True):
            q[self.model.joints[self.model.getJointId(name)].idx_q] = position
        pin.framesForwardKinematics(self.model, self.data, q)
        pin.centerOfMass(self.model, self.data, q)

    def pose(self, frame: str) -> tuple[Array, Array]:
        """Return position (3,) and axes (3, 3) of a link's frame in the root frame."""
        assert self.model.existFrame(frame), frame
        placement = self.data.oMf[self.model.getFrameId(frame)]
        return placement.translation.copy(), placement.rotation.copy()

    def center_of_mass(self) -> Array:
        """Return the centre of mass (3,) in the root frame."""
        return self.data.com[0].copy()

    def bodies(self) -> list[tuple[float, Array]]:
        """Return mass and centre of mass (3,) in the root frame of everything that moves as one."""
        return [
            (inertia.mass, placement.act(inertia.lever))
            for inertia, placement in zip(self.model.inertias, self.data.oMi, strict=True)
        ]

    def mass(self) -> float:
        """Return the total mass."""
        return sum(inertia.mass for inertia in self.model.inertias)


@dataclass(frozen=True, eq=False)
class BulletRobot:
    """A URDF placed by PyBullet."""

    client: Any
    body: int
    joints: dict[str, int]
    links: dict[str, int]
    joint_names: tuple[str, ...]

    def place(self, joint_positions: Array) -> None:
        """Move the joints to positions in the order of ``joint_names``."""
        for name, position in zip(self.joint_names, joint_positions, strict=True):
            self.client.resetJointState(self.body, self.joints[name], position)

    def pose(self, frame: str) -> tuple[Array, Array]:
        """Return position (3,) and axes (3, 3) of a link's frame in the root frame."""
        # Not the state's own link frame, which PyBullet passes through single precision.
        position, quaternion = self._link_state(self.links[frame])[:2]
        inertial = self.client.getDynamicsInfo(self.body, self.links[frame])[3:5]
        place = self._link_frame(position, quaternion, inertial)
        return self._in_root(place[0]), self._root()[1].T @ place[1]

    def center_of_mass(self) -> Array:
        """Return the centre of mass (3,) in the root frame."""
        bodies = self.bodies()
        return sum((mass * place for mass, place in bodies), np.zeros(3)) / sum(mass for mass, _ in bodies)

    def bodies(self) -> list[tuple[float, Array]]:
        """Return mass and centre of mass (3,) in the root frame of every link."""
        places = {-1: self.client.getBasePositionAndOrientation(self.body)[0]}
        places |= {link: self._link_state(link)[0] for link in self.links.values()}
        masses = {link: self.client.getDynamicsInfo(self.body, link)[0] for link in places}
        return [(masses[link], self._in_root(place)) for link, place in places.items()]

    def mass(self) -> float:
        """Return the total mass."""
        return sum(mass for mass, _ in self.bodies())

    def _link_state(self, link: int) -> Any:
        return self.client.getLinkState(self.body, link, computeForwardKinematics=1)

    def _rotation(self, quaternion: Any) -> Array:
        return np.array(self.client.getMatrixFromQuaternion(quaternion)).reshape(3, 3)

    def _in_root(self, place: Any) -> Array:
        origin, axes = self._root()
        return axes.T @ (np.array(place) - origin)

    def _root(self) -> tuple[Array, Array]:
        """Return the root link's frame; PyBullet itself only tells its frame of inertia."""
        inertial = self.client.getDynamicsInfo(self.body, -1)[3:5]
        return self._link_frame(*self.client.getBasePositionAndOrientation(self.body), inertial)

    def _link_frame(self, position: Any, quaternion: Any, inertial: Any) -> tuple[Array, Array]:
        """Return a link's frame from its frame of inertia in the world and in the link's frame."""
        axes = self._rotation(quaternion) @ self._rotation(inertial[1]).T
        return np.array(position) - axes @ np.array(inertial[0]), axes


Oracle = PinocchioRobot | BulletRobot


@pytest.fixture(scope="session")
def robot() -> Robot:
    """Jet-HR1."""
    return jet_hr1()


@pytest.fixture
def rng() -> np.random.Generator:
    """The same random numbers in every test and every run."""
    return np.random.default_rng(20240607)


@pytest.fixture(scope="session")
def load_pinocchio() -> Callable[[Path, tuple[str, ...]], PinocchioRobot]:
    """Return a reader of URDF files that knows nothing of ours."""
    pin = pytest.importorskip("pinocchio")

    def load(urdf_path: Path, joint_names: tuple[str, ...]) -> PinocchioRobot:
        model = pin.buildModelFromUrdf(str(urdf_path), pin.JointModelFreeFlyer())  # else the root has no weight
        return PinocchioRobot(model, model.createData(), joint_names)

    return load


@pytest.fixture(scope="session")
def pinocchio_robot(robot: Robot, load_pinocchio: Callable[..., PinocchioRobot]) -> PinocchioRobot:
    """Jet-HR1 in pinocchio."""
    return load_pinocchio(robot.urdf_path, robot.joint_names)


@pytest.fixture
def bullet_client() -> Iterator[Any]:
    """An empty PyBullet world of the test's own."""
    pybullet = pytest.importorskip("pybullet")
    client = importlib.import_module("pybullet_utils.bullet_client").BulletClient(pybullet.DIRECT)
    yield client
    client.disconnect()


@pytest.fixture
def bullet_robot(robot: Robot, bullet_client: Any) -> BulletRobot:
    """Jet-HR1 in PyBullet; nothing steps the world, so it stays where it is put."""
    flags = bullet_client.URDF_USE_INERTIA_FROM_FILE
    body = bullet_client.loadURDF(str(robot.urdf_path), flags=flags)
    infos = [bullet_client.getJointInfo(body, index) for index in range(bullet_client.getNumJoints(body))]
    joints = {info[1].decode(): info[0] for info in infos}
    links = {info[12].decode(): info[0] for info in infos}
    return BulletRobot(bullet_client, body, joints, links, robot.joint_names)


@pytest.fixture(params=["pinocchio", "pybullet"])
def oracle(request: pytest.FixtureRequest) -> Oracle:
    """Jet-HR1 in a library that is not ours, one after the other."""
    return request.getfixturevalue({"pinocchio": "pinocchio_robot", "pybullet": "bullet_robot"}[request.param])


@pytest.fixture(scope="session")
def side_plan() -> Plan:
    """The paper's step to the side, as GAS plans it."""
    return make_planner("gas").plan(PAPER.side, seed=0)


@pytest.fixture(scope="session")
def forward_plan() -> Plan:
    """The paper's step across the ditch, as GAS plans it."""
    return make_planner("gas").plan(PAPER.forward, seed=0)


@pytest.fixture(scope="session")
def rivals(side_plan: Plan) -> list[Plan]:
    """Plans of one step by three planners, the first of them GAS."""
    return [side_plan, *(make_planner(name).plan(PAPER.side, seed=0) for name in ("ga", "gaex"))]


@pytest.fixture(scope="session")
def experiment() -> Experiment:
    """Trials of one short step, under disturbances so large that some of them fail."""
    pytest.importorskip("pybullet")
    from jet_gym.simulation import CourseSettings, DisturbanceRanges, ExecutionSettings, SimulationSettings
    from jet_gym.simulation.trials import Experiment

    plan = make_planner("gas").plan(replace(PAPER.side, points=20), seed=0)
    course = CourseSettings(
        stand_time=0.1, shift_time=0.8, time_scale=0.3, ease_time=0.3, finish_time=0.5, rest_time=0.1
    )
    settings = ExecutionSettings(course=course, simulation=SimulationSettings(sample_every=8))
    return Experiment((plan,), settings, DisturbanceRanges().scaled(3.0), seed=5)


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    """A world that the tests use one after the other; none may notice what another did to it."""
    pytest.importorskip("pybullet")
    from jet_gym.simulation import World

    with World() as shared:
        yield shared


@pytest.fixture
def make_env() -> Iterator[Callable[..., gym.Env[Any, Any]]]:
    """Make environments that are closed after the test, which is skipped where it lacks PyBullet."""
    made: list[gym.Env[Any, Any]] = []

    def make(**options: Any) -> gym.Env[Any, Any]:
        if options.get("physics", "bullet") == "bullet" or "render_mode" in options:
            pytest.importorskip("pybullet")
        made.append(gym.make("JetHR1Step-v0", **options))
        return made[-1]

    yield make
    for env in made:
        env.close()


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """The system's Chromium, without a window or a graphics card; tests are skipped where there is none."""
    playwright = pytest.importorskip("playwright.sync_api")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("no Chromium is installed")
    quiet = ["quic", "background-networking", "component-update", "sync", "dev-shm-usage"]
    flags = ["--no-sandbox", "--no-first-run", *(f"--disable-{what}" for what in quiet)]
    software = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=[*flags, *software])
        yield browser
        browser.close()
