"""The page on the own machine: a form for a screw, answers while it is typed, files to take away."""
