"""Friction, inertia and preload of an axis from a log of its drive."""
