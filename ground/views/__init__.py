"""What the ground makes of one mission each: figures, drawing, words."""
