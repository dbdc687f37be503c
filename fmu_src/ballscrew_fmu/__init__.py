"""The FMUs of the ball screw: variables, slaves, model descriptions and packages. The physics is in ballscrew_tehl."""
