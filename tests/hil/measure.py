"""A long flight over a line, and what the line did to it: `python -m tests.hil.measure --seconds 300 --baud 921600`, or with
`--delay-ms 20 --jitter-ms 5 --loss 0.01` over UDP through a proxy. Prints the figures of the summary about lines and ticks."""

from __future__ import annotations

import argparse
import tempfile
from contextlib import ExitStack
from pathlib import Path

from hil_scripts.launch import kernel_cache

KEYS = (
    "plant.latency",
    "plant.jitter",
    "plant.repl",
    "plant.late",
    "plant.missed",
    "plant.noise",
    "plant.torn",
    "plant.clock",
)


def main() -> int:
    """Exit code of the launcher."""
    kernel_cache.use()
    from tests.hil.board import fly
    from tests.hil.proxy import Proxy
    from tests.hil.ptys import PtyLine
    from tests.sil.launch import summary

    p = argparse.ArgumentParser(prog="tests.hil.measure", description=__doc__)
    p.add_argument("--seconds", type=float, default=60.0)
    p.add_argument(
        "--baud", type=int, default=0, help="over a pseudo-terminal at this rate; 0: over UDP through the proxy"
    )
    p.add_argument("--delay-ms", type=float, default=0.0, help="each way")
    p.add_argument("--jitter-ms", type=float, default=0.0)
    p.add_argument("--loss", type=float, default=0.0)
    p.add_argument("--lockstep", action="store_true")
    p.add_argument("--port-offset", type=int, default=900)
    p.add_argument("--out", type=Path)
    p.add_argument("--set", action="append", default=[], dest="sets")
    a = p.parse_args()
    offset = a.port_offset
    run = a.out or Path(tempfile.mkdtemp(prefix="wakefield-hil-")) / "run"
    run.parent.mkdir(parents=True, exist_ok=True)
    pace: tuple[str, ...] = () if a.lockstep else ("--realtime",)
    sets = [w for s in a.sets for w in ("--set", s)]
    with ExitStack() as stack:
        if a.baud:
            line = stack.enter_context(PtyLine(baud=a.baud, first=True))
            at, link = f"serial:{line.a}:{a.baud}", ("--link", f"serial:{line.b}:{a.baud}")
        else:
            to = ("127.0.0.1", 4700 + offset)
            proxy = stack.enter_context(Proxy(to, a.delay_ms * 1e-3, a.jitter_ms * 1e-3, a.loss, first=True))
            at, link = f"udp:127.0.0.1:{proxy.port}", ("--link", f"udp:{to[0]}:{to[1]}")
        flown = fly(run, offset, at, a.seconds, (*link, *pace), *pace, *sets)
    print(flown.launcher.text[-1500:])
    print(flown.board.text)
    for k, v in sorted(summary(run).items()):
        if k.startswith(KEYS) or "rms" in k or "slips" in k or k.startswith("run."):
            print(f"{k} = {v}")
    return flown.launcher.code


if __name__ == "__main__":
    raise SystemExit(main())
