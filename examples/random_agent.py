"""A random agent in the simulated environment: it moves the pelvis at random and soon falls."""

import gymnasium as gym

import jet_gym  # noqa: F401  (registers the environment)

env = gym.make("JetHR1Step-v0")
env.action_space.seed(0)
for episode in range(3):
    observation, _ = env.reset(seed=episode)
    total, terminated, truncated = 0.0, False, False
    while not (terminated or truncated):
        observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
        total += reward
    print(f"episode {episode}: return {total:.1f}, success {info['is_success']}, {info['fall'] or 'it stands'}")
env.close()
