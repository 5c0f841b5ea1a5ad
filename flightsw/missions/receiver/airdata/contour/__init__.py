"""Position in the tanker's wake as Sevil (2013), chapter 4, prints it: contours of the wake maps and where they cross."""
