"""Recovery of the six-degree-of-freedom aircraft from random upsets."""
