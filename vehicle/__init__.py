"""The tracked robot: a planar pymunk model with the face of a part."""

from .robot import Robot

__all__ = ["Robot"]
