"""The atlas: every lubricated contact of a ball in pure rolling, solved once, interpolated in its dimensionless groups.

groups.py: groups of a contact and what its quantities are divided by; ball_contacts.py: the contacts of one screw.
"""
