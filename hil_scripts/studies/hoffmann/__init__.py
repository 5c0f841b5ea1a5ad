"""Studies on Hoffmann and Luckner."""
