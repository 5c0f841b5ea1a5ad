"""What each aircraft flies: one folder per mission, its page `mission.py`; read these first."""
