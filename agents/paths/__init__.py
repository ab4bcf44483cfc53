"""Paths of the pelvis over a whole step: what one costs, and how it becomes the best one."""
