"""Behaviour cloning: a small network learns from the optimal planner's episodes what to do in each observation.

jet-gym dataset --planner optimal --steps 500 --output datasets
MINARI_DATASETS_PATH=datasets python examples/clone_optimal.py [epochs] [clone.pt]
"""

import sys

import gymnasium as gym
import minari
import numpy as np
import torch

torch.manual_seed(0)
torch.set_num_threads(1)
epochs = int(sys.argv[1]) if len(sys.argv) > 1 else 200
episodes = list(minari.load_dataset("jet_hr1/optimal-v0").iterate_episodes())
observations = torch.as_tensor(np.concatenate([episode.observations[:-1] for episode in episodes]))
actions = torch.as_tensor(np.concatenate([episode.actions for episode in episodes]))
mean, scale = observations.mean(0), observations.std(0) + 1e-3
network = torch.nn.Sequential(
    torch.nn.Linear(observations.shape[1], 256), torch.nn.Tanh(), torch.nn.Linear(256, 256), torch.nn.Tanh(),
    torch.nn.Linear(256, 3),
)  # fmt: skip
optimizer = torch.optim.Adam(network.parameters(), lr=1e-3)
for _ in range(epochs):
    for batch in torch.randperm(len(actions)).split(256):
        loss = torch.nn.functional.mse_loss(network((observations[batch] - mean) / scale), actions[batch])
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()

env, returns = gym.make("jet_gym:JetHR1Step-v0", physics="quasistatic"), []
for seed in range(20):
    (observation, _), total, over = env.reset(seed=10_000 + seed), 0.0, False
    while not over:
        with torch.no_grad():
            action = network((torch.as_tensor(observation) - mean) / scale).clamp(-1.0, 1.0).numpy()
        observation, reward, over, _, _ = env.step(action)
        total += reward
    returns.append(total)
path = sys.argv[2] if len(sys.argv) > 2 else "clone.pt"
torch.save({"network": network.state_dict(), "mean": mean, "scale": scale}, path)
print(f"cloned {len(episodes)} episodes, loss {loss.item():.4f}, mean return {np.mean(returns):.1f} on new steps")
