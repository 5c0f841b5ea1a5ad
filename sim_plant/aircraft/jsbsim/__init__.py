"""Aircraft whose motion JSBSim integrates; everything else is the plant's own. Rests on the six-degree-of-freedom kind."""
