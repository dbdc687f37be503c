"""Friction torque of preloaded double-nut ball screws from thermal elastohydrodynamic lubrication.

The package imports nothing by itself: a command line answer must not wait for a compiler.
"""

__version__ = "0.1.0"
__date__ = "2026-11-21"  # of this version; before its release, of the start of the work on it
