"""What the studio draws in its scene: the robot, what it stands on, its path, its balance."""
