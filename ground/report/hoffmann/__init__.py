"""The page on Hoffmann and Luckner."""
