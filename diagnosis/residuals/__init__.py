"""Measured minus simulated: which comparisons a log allows, from measured inputs through compiled laws, and their noise."""
