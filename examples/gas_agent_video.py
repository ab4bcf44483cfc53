"""GAS as an agent: its plan for the step across the ditch, replayed in simulation and filmed as GIF or WebP.

python examples/gas_agent_video.py [gas.gif | gas.webp]
"""

import sys
from dataclasses import replace

import gymnasium as gym
from PIL import Image

from agents import make_planner
from jet_gym.courses import PAPER

path = sys.argv[1] if len(sys.argv) > 1 else "gas.gif"
if not path.endswith((".gif", ".webp")):
    sys.exit(f"an animation cannot be saved as '{path}'; its name must end in .gif or .webp")
step = replace(PAPER.forward, points=60)
plan = make_planner("gas").plan(step)
env = gym.make("JetHR1Step-v0", render_mode="rgb_array", step=step)
env.reset()
frames, total = [Image.fromarray(env.render())], 0.0
for pelvis in plan.pelvis:
    _, reward, _, _, info = env.step(env.unwrapped.action_to(pelvis))
    frames.append(Image.fromarray(env.render()))
    total += reward
env.close()
frames[0].save(path, save_all=True, append_images=frames[1:], duration=100, loop=0, quality=60)
print(f"return {total:.2f}, success {info['is_success']}, wrote {path}")
