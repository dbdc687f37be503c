"""Direct solves of the balls at an operating point, and a map corrected by them."""
