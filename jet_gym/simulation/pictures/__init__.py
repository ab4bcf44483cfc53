"""Pictures and films of the simulated robot: camera, shading, what is drawn over them, and how they are encoded."""
