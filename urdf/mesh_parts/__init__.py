"""What the robot's meshes are made of: solids, and the parts of the robot."""
