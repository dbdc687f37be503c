"""Tables of numbers that users have: one CSV dialect, one list of headings and units."""
