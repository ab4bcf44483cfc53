"""The task of choosing postures, in which environments and learnt planners alike observe and act."""

ENVIRONMENT_ID = "JetHR1Step-v0"
"""The task's id in Gymnasium; a policy file names it."""
