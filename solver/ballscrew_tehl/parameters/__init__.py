"""What a screw file says: screw, oil, friction choices, units; checked once, here."""
