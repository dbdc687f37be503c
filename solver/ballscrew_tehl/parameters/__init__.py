"""Content of a screw file: screw, oil, friction choices and units, checked once on reading."""
