"""A refuelling whose receiver or tanker falls silent for a while, in process: by a cut cable (the onboard software lives on and
hears nothing either) or by its death (what comes back is fresh). `python -m tests.hil.cuts` prints the table, with
`rejoin` another: the receiver, ordered to from wherever the silence has sent it, comes back into contact."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flightsw.icd.port import Handed
    from hil_scripts.launch.runfolder import RunPlan
    from hil_scripts.studies.integrity.snapshot import Flying

ORDERS = ((10.0, "precontact"), (16.0, "contact"))
AGAIN = ((20.0, "observation"), (120.0, "precontact"), (270.0, "contact"))  # [s] after the return
AGAIN_S = 320.0
POINTS = ("plant.aircraft.receiver.start.xi_m", "receiver.guid.observation_m", "receiver.guid.precontact_m")
AT_S = {"observation": 20.0, "precontact": 15.0, "contact": 32.0}
TANKER, RECEIVER = 0, 1
FOR_EVER = 1e9
LONGEST_S = 500.0  # [s] of a flight, planned


@lru_cache(4)
def _before(
    where: str, again: tuple[tuple[float, str], ...], sets: tuple[str, ...]
) -> tuple[RunPlan, Flying[Handed], str]:
    """The plan, the flight until the cut and the receiver's phase then; again: orders after the return."""
    from hil_scripts.launch.runfolder import resolve
    from hil_scripts.studies.integrity.snapshot import HEARD, Flying

    near = [] if where == "observation" else [f"{key}=[-38.0, 0.0, 6.7]" for key in POINTS]
    told = [] if where == "observation" else [x for x in ORDERS if x[1] == "precontact" or where == "contact"]
    orders = ", ".join(
        f'{{t_s={t}, kind="command", target="receiver", action="{name}"}}' for t, name in (*told, *again)
    )
    plan = resolve("refueling", 3, [*near, *([f"plant.event=[{orders}]"] if orders else []), *sets], LONGEST_S)
    f = Flying.of(plan)
    f.hear_only(frozenset(), HEARD)
    return plan, f, f.fly_to(AT_S[where]).upper()


@dataclass
class Flown:
    """What came of it: worst from the cut on; separation and height [m] of the receiver; phase at the end; lost or not."""

    bank_deg: float
    highest_m: float  # least z of the receiver under the tanker
    closest_m: float
    back_s: float  # from the return to the first valid navigation: from then on its law has the aircraft
    phase: str
    lost: str
    bank_then_deg: float  # when it was back
    contact_s: float = 0.0  # in contact after that


def fly(
    where: str,
    who: int,
    seconds: float,
    fresh: bool,
    after_s: float = 15.0,
    sets: Sequence[str] = (),
    rejoin: bool = False,
) -> Flown:
    """Cut aircraft `who` for `seconds` once the receiver is at `where`; fly on for `after_s` s, with the orders of AGAIN if it is
    to rejoin."""
    from flightsw.icd.port import DIRECT
    from flightsw.process.config import flight_of
    from flightsw.process.node import Node
    from hil_scripts.studies.integrity.snapshot import HEARD, STATUS, phase_in, said
    from sim_plant.kernels import layout as n
    from sim_plant.lost import AircraftLostError

    at_s = AT_S[where]
    alive_s = min(seconds, 30.0)  # of one for good as much is looked at
    plan, begun, phase = _before(
        where, tuple((at_s + seconds + t, name) for t, name in AGAIN) if rejoin else (), tuple(sets)
    )
    f = begun.fork()
    server, members = f.server, f.server.world.members
    out = Flown(0.0, math.inf, math.inf, math.nan, phase, "", 0.0)
    back, end = round((at_s + seconds) * 100), round((at_s + alive_s + after_s) * 100)
    try:
        while server.tick < end:
            k = server.tick
            silent = k < back
            if k == back and fresh:
                f.nodes[who] = Node(flight_of(plan.flights[who].config, server.names[who]), port=DIRECT)
                f.hear_only(frozenset(), HEARD)
                out.bank_then_deg = math.degrees(members[who].view.o[n.O_EULER + 2])
            sent = server.begin_tick()
            replies: list[Handed] = [
                () if silent and i == who else node.step((d,))
                for i, (node, d) in enumerate(zip(f.nodes, sent, strict=True))
            ]
            server.end_tick(replies)
            for i, node in enumerate(f.nodes):
                if not (silent and i == who):
                    for kind, fields in said(node.after()):
                        out.phase = phase_in(fields).upper() if kind == STATUS and i == RECEIVER else out.phase
            v = members[RECEIVER].view
            xi = v.rel[n.R_XI : n.R_XI + 3]
            out.bank_deg = max(out.bank_deg, abs(math.degrees(members[who].view.o[n.O_EULER + 2])))
            out.highest_m = min(out.highest_m, xi[2])
            out.closest_m = min(out.closest_m, math.hypot(*xi))
            out.contact_s += 0.01 * (k >= back and v.contact)
            if k >= back and math.isnan(out.back_s) and f.nodes[who].app.nav.valid and f.nodes[who].app.tick_no:
                out.back_s = (k - back) / 100.0
    except AircraftLostError as e:
        out.lost = str(e)
    return out


def main() -> None:
    """The table."""
    print(
        "| who | where | silent | what | bank [deg] | least z [m] | closest [m] | estimate back after [s] | phase after | lost |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    for who, name in ((RECEIVER, "receiver"), (TANKER, "tanker")):
        for where in AT_S:
            for seconds in (0.3, 1.0, 3.0, 5.0, 30.0, FOR_EVER):
                for fresh in (False, True) if seconds < FOR_EVER else (False,):
                    r = fly(where, who, seconds, fresh)
                    what = "killed" if fresh else "cut"
                    print(
                        f"| {name} | {where} | {seconds:g} s | {what} | {r.bank_deg:.1f} | {r.highest_m:.1f} | "
                        f"{r.closest_m:.1f} | {r.back_s:.2f} | {r.phase.lower()} | {r.lost or '-'} |",
                        flush=True,
                    )


def rejoin() -> None:
    """Its table."""
    print("| who | silent | what | phase after | in contact again [s] | lost |")
    print("|---|---|---|---|---|---|")
    for who, name in ((RECEIVER, "receiver"), (TANKER, "tanker")):
        for seconds, fresh in ((1.0, False), (1.0, True), (5.0, False), (5.0, True)):
            r = fly("contact", who, seconds, fresh, AGAIN_S, rejoin=True)
            what = "killed" if fresh else "cut"
            print(
                f"| {name} | {seconds:g} s | {what} | {r.phase.lower()} | {r.contact_s:.0f} | {r.lost or '-'} |",
                flush=True,
            )


if __name__ == "__main__":
    from hil_scripts.launch import kernel_cache

    kernel_cache.use()
    rejoin() if "rejoin" in sys.argv[1:] else main()
