"""Friction of a map as tables for controllers and simulation tools."""
