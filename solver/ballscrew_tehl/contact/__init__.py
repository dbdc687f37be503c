"""Thermal elastohydrodynamic solve of one elliptical contact.

The package imports nothing by itself; `solve` is the entrance, `moes` the one for dimensionless comparison.
"""
