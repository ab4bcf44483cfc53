"""A model of yours against GAS on the same random steps; here yours is "stay where you are".

With Stable-Baselines3: model = PPO.load("mine"); predict = lambda o: model.predict(o, deterministic=True)[0]
"""

import gymnasium as gym
import numpy as np

from agents import make_planner


def predict(observation):  # noqa: ARG001
    return np.zeros(3)  # put your model here


env = gym.make("jet_gym:JetHR1Step-v0", physics="quasistatic", reward="fitness")
wins = 0
for seed in range(10):
    (observation, _), mine, over = env.reset(seed=seed), 0.0, False
    while not over:
        observation, _, over, _, info = env.step(predict(observation))
        mine += info["fitness"]
    gas = make_planner("gas").plan(env.unwrapped.current_step, seed=0).total_fitness
    wins += mine < gas
    print(f"step {seed}: total fitness {mine:.0f}, GAS {gas:.0f}")
print(f"yours is better on {wins} of 10 steps")
