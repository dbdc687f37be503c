"""Friction parameters fitted to measured torques."""
