"""The earth under the plant: flat with constant gravity, or round, turning and oblate; and bodies dropped over it."""
