"""Your own reward by a wrapper: thrust counts twice, and a success is worth ten points at full thrust."""

import gymnasium as gym
import numpy as np

import jet_gym  # noqa: F401  (registers the environment)


class MyReward(gym.Wrapper):
    """Builds a reward from the named terms of the environment's own."""

    def step(self, action):
        observation, _, terminated, truncated, info = self.env.step(action)
        terms = info["reward_terms"]
        reward = sum(terms.values()) + terms["thrust"] + 10.0 * info.get("is_success", False)
        return observation, reward, terminated, truncated, info


env = MyReward(gym.make("JetHR1Step-v0", physics="quasistatic"))
env.reset(seed=0)
total, terminated = 0.0, False
while not terminated:
    _, reward, terminated, _, info = env.step(np.array([0.0, -0.2, -0.1], dtype=np.float32))
    total += reward
print(f"return {total:.2f}, success {info['is_success']}")
