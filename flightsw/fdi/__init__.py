"""Air-data fault detection and isolation in parity space (Sevil 2013, chapter 5, with the errata E1 to E8 put right).

parity.py residuals and their normalisation; detectors.py windows and CUSUM over whole records; isolation.py which probe;
two_faults.py more than one, with a virtual sensor; metrics.py alarm percentages; correction.py body rotation; monitor.py
the onboard component. Readings are ordered V1..3, beta1..3, alpha1..3 [m/s, rad]; probes 0 nose, 1 left tip, 2 right tip.
"""
