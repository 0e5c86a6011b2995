"""MJCF models: a flexible robot with its lane, and a planar one with its plane."""
