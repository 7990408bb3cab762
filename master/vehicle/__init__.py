"""The tracked robot: a planar pymunk model with the face of a part."""

from master.vehicle.robot import Robot

__all__ = ["Robot"]
