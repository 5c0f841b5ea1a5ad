"""The gust estimator that also finds out what its servos, its lift and its airspeed sensor are."""
