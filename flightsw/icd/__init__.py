"""Message ICD: house.xml, what is generated from it (mav.py), the fast codec, the `.tlog` format and the UDP endpoints."""
