"""A vane that jumps while the load does not: no air does that, so the vane is left out, and then its bias is sought anew."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from flightsw.strict import Range

USE, LEAVE, ANEW = range(3)


@dataclass(frozen=True)
class VaneJumpParams:
    """[nav.servo_bank.vane]. Sigmas are those of the innovations of the mixture over intensity."""

    jump: Annotated[float, Range(1.0, 1e3)] = 5.0  # sigma of the vane from which it has jumped,
    load: Annotated[float, Range(0.1, 1e3)] = 3.0  # unless the load is off by as many
    out_s: Annotated[float, Range(0.02, 60.0)] = 0.2  # [s] left out before the bias is sought anew
    anew_rad: Annotated[float, Range(1e-3, 1.0)] = 0.15  # 1-sigma of the bias then
    rest_s: Annotated[float, Range(0.0, 600.0)] = 10.0  # [s] before it may be again


class VaneJump:
    """`judge` once per sample that has both readings. `out_s` [s] left out so far, `rest_s` [s] before the next search."""

    def __init__(self, p: VaneJumpParams) -> None:
        self.p = p
        self.out_s = self.rest_s = 0.0

    def judge(self, vane: float, load: float, dt: float) -> int:
        """USE the vane, LEAVE it out, or use it, its bias sought ANEW: its innovation and that of the load [sigma], dt [s]."""
        self.rest_s = max(self.rest_s - dt, 0.0)
        if not vane > self.p.jump or load > self.p.load:
            self.out_s = 0.0
            return USE
        self.out_s += dt
        if self.out_s < self.p.out_s or self.rest_s > 0.0:
            return LEAVE
        self.rest_s = self.p.rest_s
        return ANEW
