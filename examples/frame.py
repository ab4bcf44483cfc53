"""A frame of Jet-HR1 over the ditch, as GAS steps across it in simulation.

python examples/frame.py [frame.png]
"""

import sys
from dataclasses import replace

import gymnasium as gym
from PIL import Image

from agents import make_planner
from jet_gym.courses import PAPER

path = sys.argv[1] if len(sys.argv) > 1 else "frame.png"
if not path.endswith((".png", ".jpg", ".webp")):
    sys.exit(f"a frame cannot be saved as '{path}'; its name must end in .png, .jpg or .webp")
step = replace(PAPER.forward, points=60)
env = gym.make("JetHR1Step-v0", render_mode="rgb_array", step=step)
env.reset()
for pelvis in make_planner("gas").plan(step).pelvis[:50]:
    env.step(env.unwrapped.action_to(pelvis))
Image.fromarray(env.render()).save(path)
env.close()
print(f"wrote {path}")
