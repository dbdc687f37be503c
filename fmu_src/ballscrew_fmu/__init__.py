"""The FMU of the ball screw: variables, slave, model description and package. No physics lives here."""
