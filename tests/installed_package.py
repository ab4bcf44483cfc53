"""What somebody does with a package that was just installed; run outside of the repository, by whoever has it.

    python tests/installed_package.py FOLDER [--quick]

FOLDER is where the package must be; --quick leaves out what takes long to compile. Prints one line for each thing
that worked. Uses nothing but the base install.
"""

import argparse
import importlib.util
from pathlib import Path

import gymnasium
import numpy as np

import agents
import jet_gym
from jet_gym.cli import run
from jet_gym.courses import PAPER
from jet_gym.robot import urdf_directory


def main(folder: str, quick: bool) -> None:
    """Use the package as a newcomer does."""
    for module in (jet_gym, agents):
        assert module.__file__ is not None
        assert Path(module.__file__).resolve().is_relative_to(Path(folder).resolve()), module.__file__
    assert urdf_directory().is_relative_to(Path(folder).resolve()), urdf_directory()
    print(f"robot: {jet_gym.jet_hr1().mass:.1f} kg")

    assert run(["plan", "side", "--points", "20", "--plot", "plan.png"]) == 0
    assert len(agents.Plan.load("plan.json").thrust) == 20
    print(f"policy: total fitness {agents.make_planner('policy').plan(PAPER.side).total_fitness:.0f}")
    if not quick:
        compare = ["compare", "--planner", "policy", "--planner", "policy+refine", "--steps", "2"]
        assert run([*compare, "--json", "compare.json"]) == 0

    physics = ["quasistatic"]
    if importlib.util.find_spec("pybullet") is not None:
        physics.append("bullet")
    else:
        print(f"without PyBullet: {refusal()}")
    for kind in physics:
        env = gymnasium.make("JetHR1Step-v0", physics=kind)
        observation, _ = env.reset(seed=0)
        assert np.isfinite(observation).all()
        assert np.isfinite(env.step(env.action_space.sample())[1])
        env.close()
        print(f"JetHR1Step-v0: {kind}")
    if not quick:
        envs = gymnasium.make_vec("JetHR1Step-v0", num_envs=8, vectorization_mode="vector_entry_point")
        assert envs.reset(seed=0)[0].shape[0] == 8
        print("JetHR1Step-v0: a batch")


def refusal() -> str:
    """Return what making the environment with physics says where there is none."""
    try:
        gymnasium.make("JetHR1Step-v0")
    except jet_gym.JetGymError as error:
        return str(error)
    raise AssertionError("PyBullet is missing, and gymnasium.make says nothing")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Use an installed package as a newcomer does.")
    parser.add_argument("folder")
    parser.add_argument("--quick", action="store_true")
    main(**vars(parser.parse_args()))
