"""Refuelling in closed loop under every grade of sensors and level of turbulence."""
