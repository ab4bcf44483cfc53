"""Watch a trained policy step in simulation: an animation, or PyBullet's window.

python examples/watch_policy.py [policy.gif | policy.webp | --window] [runs/mine/best/policy.npz]
"""

import sys

import gymnasium as gym
from PIL import Image

import jet_gym  # noqa: F401
from agents.policy import SHIPPED_POLICY, load_policy

target = sys.argv[1] if len(sys.argv) > 1 else "policy.gif"
if target != "--window" and not target.endswith((".gif", ".webp")):
    sys.exit(f"an animation cannot be saved as '{target}'; its name must end in .gif or .webp")
policy = load_policy(sys.argv[2] if len(sys.argv) > 2 else SHIPPED_POLICY)
env = gym.make("JetHR1Step-v0", render_mode="human" if target == "--window" else "rgb_array")
observation, _ = env.reset(seed=4)
frames, over, total, info = [], False, 0.0, {}
while not over:
    observation, reward, terminated, truncated, info = env.step(policy.act(observation[None])[0])
    total, over = total + float(reward), terminated or truncated
    if target != "--window":
        frames.append(Image.fromarray(env.render()))
print(f"return {total:.2f}, {'a success' if info['is_success'] else 'no success ' + info['fall']}")
if frames:
    duration = 1000 // env.metadata["render_fps"]  # [ms]
    frames[0].save(target, save_all=True, append_images=frames[1:], duration=duration, loop=0)
    print(f"wrote {target}")
env.close()
