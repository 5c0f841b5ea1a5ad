"""A stand-in for one of the programs: status lines, words on stderr, an exit code; deaf to SIGTERM if asked."""

from __future__ import annotations

import json
import signal
import sys
import time

if __name__ == "__main__":
    manner, lines, code = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    if manner == "deaf":
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
    for i in range(lines):
        print(json.dumps({"t": 0.1 * i, "tick": i}), flush=True)
        time.sleep(0.05)
    print("last words", end="", file=sys.stderr, flush=True)
    sys.exit(code)
