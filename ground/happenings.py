"""What happened in a run, in words and by time: phases, texts, commands and their answers, failures, events of the scenario."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flightsw.icd.dialect import ENUMS
from flightsw.icd.tlog import GROUND_IN, LINK_IN
from ground.columns import Columns
from ground.link.packets import phase_name
from ground.whole import scenario

if TYPE_CHECKING:
    from ground.run import Run

COMMANDS = ("COMMAND_LONG", "COMMAND_INT")


@dataclass(frozen=True)
class Event:
    """Something that happened: time [s], aircraft ("" the scenario's own), kind (phase, text, command, answer, failure, planned),
    words; severity as in MAVLink, 6 for what is only information."""

    t_s: float
    who: str
    kind: str
    text: str
    severity: int = 6


def happened(run: Run) -> list[Event]:
    """Everything that happened, by time."""
    out = list(_planned(run))
    for sysid, name in run.names.items():
        out += _commands(run.link(name), name)
        out += _texts(run.plant, sysid, name, "failure")
        out += _phases(run.tlm, sysid, name)
        out += _texts(run.tlm, sysid, name, "text")
    return sorted(dict.fromkeys(out), key=lambda e: e.t_s)  # an answer goes to whoever asked and to the ground


def _word(raw: bytes) -> str:
    return raw.decode("utf-8", "replace")


def _entry(enum: str, value: int) -> str:
    """Name of an entry without the enumeration's own, its number if it has none."""
    entry = ENUMS.get(enum, {}).get(value)
    return entry.name.removeprefix(f"{enum}_") if entry else str(value)


def _phases(tlm: Columns, sysid: int, name: str) -> Iterator[Event]:
    table = tlm.get(sysid, "MISSION_STATUS")
    if table is None:
        return
    phase = table["phase"].astype(int)
    for k in np.flatnonzero(np.diff(phase, prepend=-1) != 0):
        yield Event(int(table.t_us[k]) / 1e6, name, "phase", f"{phase_name(phase[k])} ({_word(table['reason'][k])})")


def _texts(log: Columns, sysid: int, name: str, kind: str) -> Iterator[Event]:
    table = log.get(sysid, "STATUSTEXT")
    if table is not None:
        for t, text, severity in zip(table.t_us, table["text"], table["severity"], strict=True):
            yield Event(int(t) / 1e6, name, kind, _word(text), int(severity))


def _commands(link: Columns, name: str) -> Iterator[Event]:
    """What an aircraft was told (by the ground or by the scenario through the plant) and what it answered."""
    for (_, message), table in sorted(link.tables.items(), key=lambda item: item[0][1] == "COMMAND_ACK"):
        if message in COMMANDS:
            table = table.pick(np.isin(table.link, (LINK_IN, GROUND_IN)))
            for k in range(len(table)):
                given = [f"{table[f'param{i}'][k]:g}" for i in range(1, 5)]
                while given and given[-1] in ("0", "nan"):
                    given.pop()
                words = " ".join((_entry("MAV_CMD", int(table["command"][k])), *given))
                yield Event(int(table.t_us[k]) / 1e6, name, "command", words)
        elif message == "COMMAND_ACK":
            for t, command, result in zip(table.t_us, table["command"], table["result"], strict=True):
                words = f"{_entry('MAV_CMD', int(command))}: {_entry('MAV_RESULT', int(result))}"
                yield Event(int(t) / 1e6, name, "answer", words)


def _planned(run: Run) -> Iterator[Event]:
    """The scenario's [[event]] and [[command]] tables."""
    for e in scenario(run.folder).get("event", []):
        more = " ".join(f"{k}={v}" for k, v in e.items() if k not in ("t_s", "target") and v and v != -1)
        yield Event(float(e.get("t_s", 0.0)), str(e.get("target", "")), "planned", more)
