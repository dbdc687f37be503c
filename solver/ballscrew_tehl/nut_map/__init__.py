"""The nut map: friction and film of a whole nut over (axial force, speed, temperature).

The package imports nothing by itself.
"""
