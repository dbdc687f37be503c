"""The atlas: every lubricated contact of a ball in pure rolling, solved once, interpolated in its dimensionless groups.

The package imports nothing by itself. groups.py says what a contact is given by and what its quantities are divided by,
interpolation.py interpolates, contact_atlas.py reads the file, ball_contacts.py gives the contacts of one screw.
"""
