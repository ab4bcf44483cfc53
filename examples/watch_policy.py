"""Watch a trained policy step in simulation: a film, or PyBullet's window.

python examples/watch_policy.py [film.mp4 | --window] [runs/mine/best/policy.npz]
"""

import sys

import gymnasium as gym
import imageio.v3 as imageio

import jet_gym  # noqa: F401
from agents.policy import SHIPPED_POLICY, load_policy

target = sys.argv[1] if len(sys.argv) > 1 else "policy.mp4"
policy = load_policy(sys.argv[2] if len(sys.argv) > 2 else SHIPPED_POLICY)
env = gym.make("JetHR1Step-v0", render_mode="human" if target == "--window" else "rgb_array")
observation, _ = env.reset(seed=4)
frames, over, total, info = [], False, 0.0, {}
while not over:
    observation, reward, terminated, truncated, info = env.step(policy.act(observation[None])[0])
    total, over = total + float(reward), terminated or truncated
    if target != "--window":
        frames.append(env.render())
print(f"return {total:.2f}, {'a success' if info['is_success'] else 'no success ' + info['fall']}")
if frames:
    imageio.imwrite(target, frames, fps=env.metadata["render_fps"])
    print(f"wrote {target}")
env.close()
