"""An aircraft file from a flight: test inputs and what the sensors said to them (docs/identify.md)."""
