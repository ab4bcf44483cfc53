"""PPO in a few lines of Stable-Baselines3; needs `pip install "jet-gym[train]"`.

python examples/train_sb3.py [200000]
"""

import sys

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

torch.set_num_threads(1)  # small networks: a second thread costs more than it gives
steps = int(sys.argv[1]) if len(sys.argv) > 1 else 200_000
options = {"physics": "quasistatic"}
envs = make_vec_env("jet_gym:JetHR1Step-v0", n_envs=16, seed=0, env_kwargs=options)
test = make_vec_env("jet_gym:JetHR1Step-v0", n_envs=1, seed=10_000, env_kwargs=options)
model = PPO(
    "MlpPolicy", envs, n_steps=128, batch_size=512, gamma=0.95, policy_kwargs={"log_std_init": -1.0}, seed=0
)
before, _ = evaluate_policy(model, test, n_eval_episodes=20)
model.learn(steps)
after, _ = evaluate_policy(model, test, n_eval_episodes=20)
print(f"mean return over 20 random steps: {before:.1f} before, {after:.1f} after {steps} training steps")
