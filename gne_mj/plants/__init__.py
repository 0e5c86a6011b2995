"""Agents, and the engines that move them; nothing here knows a controller."""
