"""Aircraft with coefficients in incidence and deflections, in body axes (Lee 2011). Rests on the six-degree-of-freedom kind."""
