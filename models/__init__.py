"""MJCF models: one flexible robot and the lane that a fleet of them runs in."""
