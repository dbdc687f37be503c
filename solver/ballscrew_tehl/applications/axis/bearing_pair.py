"""Friction torque of a pair of support bearings."""
