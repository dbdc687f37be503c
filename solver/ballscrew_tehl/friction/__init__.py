"""Friction parts of the balls, fitted sets of their parameters, and the torque of the double nut."""
