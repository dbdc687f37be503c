"""The axis around a screw: friction of support bearings, guide, wipers and motor, and the budget of all of it."""
