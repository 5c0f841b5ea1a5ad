"""What the plant has lost or been late with, for the summary of a run: flat keys that end in what is counted."""

from __future__ import annotations

from sim_plant.loops import UdpPlant
from sim_plant.server import PlantServer


def accounts(server: PlantServer, link: UdpPlant | None = None) -> dict[str, int | float]:
    """Accounts of a run; without a link (all in one process) nothing can be late or lost on the way."""
    names = server.names
    missed = link.missed if link is not None else [0] * len(names)
    silent = link.quiet.times if link is not None else [0] * len(names)
    return {
        "late_ticks": 0 if link is None else link.late_ticks,
        "overrun_datagrams": 0 if link is None else link.overrun,
        "refused_by_signing": 0 if link is None else link.refused,
        "refused_orders": server.desk.strangers,
        "refused_order_packets": server.desk.count.bad,
        "unread_orders": 0 if link is None else link.unread,
        "stray_datagrams": 0 if link is None else link.stray,
        "unsent_datagrams": 0 if link is None else link.unsent,
        **({} if link is None else link.books.accounts()),
        **{f"silent_times.{n}": k for n, k in zip(names, silent, strict=True)},
        **{f"missed_ticks.{n}": k for n, k in zip(names, missed, strict=True)},
        **{f"rejected_datagrams.{n}": k for n, k in zip(names, server.rejected, strict=True)},
    }
