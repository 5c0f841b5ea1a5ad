"""The parameter protocol: list, read, set. A change that may be made goes to the application with the next tick and is answered
when that has said whether it is in force; a refusal comes with PARAM_ERROR, the value in force and a text that says why.
"""

from __future__ import annotations

import dataclasses
from collections import deque
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from flightsw.icd.dialect import VALUES
from flightsw.icd.wire import Sender
from flightsw.process.parameters import Parameter
from flightsw.types import Setting, Settled, Text

PER_SLOT = 20  # answers to PARAM_REQUEST_LIST go down at this pace per telemetry tick
SETTINGS_MAX = 16  # changes of one tick
INFO, WARNING = 6, 4  # MAV_SEVERITY
F32_MAX = 3.4e38  # a value beyond the range of the wire's float has no business as a parameter: it is held there
_REAL32 = VALUES["MAV_PARAM_TYPE_REAL32"]
UNKNOWN, OUT_OF_RANGE, DENIED, READ_ONLY = (
    VALUES[f"MAV_PARAM_ERROR_{n}"] for n in ("DOES_NOT_EXIST", "VALUE_OUT_OF_RANGE", "PERMISSION_DENIED", "READ_ONLY")
)

Maker = Callable[[], bytes]


class ParameterDesk:
    """Parameters of one aircraft. `queue` takes what makes an answer; `texts` is what is to be told; `pending` the changes for
    the next tick."""

    def __init__(self, send: Sender, parameters: Iterable[Parameter], queue: Callable[[Maker], None]) -> None:
        self.send, self._queue = send, queue
        self.all = list(parameters)
        self._by_name = {p.name: i for i, p in enumerate(self.all)}
        self._by_key = {p.key: i for i, p in enumerate(self.all)}
        self._list: deque[int] = deque()
        self.pending: list[Setting] = []
        self.texts: list[Text] = []
        self.excess = 0  # changes beyond what one tick takes

    def handle(self, kind: str, f: dict[str, Any], sender: tuple[int, int], may: bool) -> None:
        """PARAM_REQUEST_LIST, PARAM_REQUEST_READ or PARAM_SET with fields `f`; may: the sender is one who may change things."""
        if kind == "PARAM_REQUEST_LIST":
            self._list = deque(range(len(self.all)))
            return
        index = f.get("param_index", -1)
        if index < 0:
            index = self._by_name.get(f["param_id"], -1)
        if not 0 <= index < len(self.all):
            self._error(f["param_id"], f.get("param_index", -1), UNKNOWN, sender)
        elif kind == "PARAM_SET":
            self._set(self.all[index], f["param_value"], sender, may)
        else:
            self._queue(partial(self._value, index))

    def _set(self, p: Parameter, value: float, sender: tuple[int, int], may: bool) -> None:
        if not may:
            return self._refuse(p, f"{p.name}: system {sender[0]} is no operator", DENIED, sender)
        if not p.in_flight:
            return self._refuse(p, f"{p.name}: not to be changed in flight", READ_ONLY, sender)
        try:
            plain = p.plain(value)
        except ValueError as e:
            return self._refuse(p, str(e), OUT_OF_RANGE, sender)
        if len(self.pending) >= SETTINGS_MAX:
            self.excess += 1
        else:
            self.pending.append(Setting(p.key, plain, *sender))
        return None

    def take(self) -> list[Setting]:
        """The changes for this tick."""
        out, self.pending = self.pending, []
        return out

    def settled(self, done: Iterable[Settled]) -> None:
        """What the application says of changes: into the values, and to whoever asked."""
        for d in done:
            s = d.setting
            i = self._by_key[s.key]
            p = self.all[i]
            if d.why:
                self._refuse(p, f"{p.name}: {d.why}", DENIED, (s.src_system, s.src_component))
                continue
            wire = float(p.words.index(s.value)) if isinstance(s.value, str) else float(s.value)
            self.texts.append(Text(INFO, f"{p.name} {p.value:.7g} -> {wire:.7g}"))
            self.all[i] = dataclasses.replace(p, value=wire)
            self._queue(partial(self._value, i))

    def _refuse(self, p: Parameter, why: str, error: int, sender: tuple[int, int]) -> None:
        self._error(p.name, -1, error, sender)
        self._queue(partial(self._value, self._by_name[p.name]))
        self.texts.append(Text(WARNING, why))

    def _error(self, name: str, index: int, error: int, sender: tuple[int, int]) -> None:
        fields = {"param_id": name, "param_index": index, "error": error}
        self._queue(
            partial(self.send.named, "PARAM_ERROR", target_system=sender[0], target_component=sender[1], **fields)
        )

    @property
    def busy(self) -> bool:
        """Whether a list is under way or something is to be told."""
        return bool(self._list or self.texts)

    def listed(self) -> list[Maker]:
        """Makers of the next part of the list."""
        return [partial(self._value, self._list.popleft()) for _ in range(min(PER_SLOT, len(self._list)))]

    def told(self) -> list[Text]:
        """Texts since the last call."""
        out, self.texts = self.texts, []
        return out

    def _value(self, i: int) -> bytes:
        p = self.all[i]
        return self.send.named(
            "PARAM_VALUE",
            param_id=p.name,
            param_value=max(-F32_MAX, min(F32_MAX, p.value)),
            param_type=_REAL32,
            param_count=len(self.all),
            param_index=i,
        )
