"""What a flight process has lost or been late with, for the summary of its run: flat keys that end in their unit or in what is
counted. In lockstep time means nothing and its figures are 0.
"""

from __future__ import annotations

from flightsw.process.node import Node


def accounts(node: Node, overrun: int = 0) -> dict[str, int | float]:
    """Accounts of a process at its end; `overrun` datagrams were dropped at its sockets."""
    ex = node.exec
    return {
        "ticks": ex.ticks,
        "slips": ex.slips,
        "late_p99_us": round(ex.late.quantile(0.99), 1),
        "late_max_us": round(ex.late.max, 1),
        "exec_max_us": round(ex.cost.max, 1),
        "unsent_datagrams": node.telemetry.ctx.dropped,
        "unlogged_datagrams": node.heard_lost,
        "overrun_datagrams": overrun,
        "refused_packets": node.count.bad + node.count.out_of_order + node.count.ahead + node.count.stale,
        "refused_ground_packets": node.services.count.bad,
        "refused_by_signing": sum(node.refused),
        "refused_orders": node.services.strangers,
        "unread_packets": node.excess,
    }
