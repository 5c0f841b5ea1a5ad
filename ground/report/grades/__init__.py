"""Report on the refuelling by grade of sensors and level of turbulence."""
