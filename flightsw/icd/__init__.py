"""Message ICD: house.xml and the dialect read from it, the fast codec, the `.tlog` format and the UDP endpoints."""
