"""A made-up refuelling run, packed by the real wire packer: known errors, so that metrics have known answers.

Tanker: straight, a 180 deg turn at 1.7 deg/s, straight. Receiver: observation, pre-contact, contact, back; it sits
`error` off its command and estimates the wind `wind_error` off the truth, exactly.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from flightsw.icd.tlog import TlogWriter
from flightsw.icd.wire import Sender
from ground.geometry import euler_quat, quat_mul, quat_rotate

OBSERVATION, PRECONTACT, CONTACT = (-59.13, 56.33, 0.0), (-50.0, 0.0, 12.0), (-35.5, 0.0, 8.5)
PHASES = ((0.0, 1, "start"), (0.1, 2, "command precontact"), (0.2, 3, "at precontact"), (0.25, 4, "command contact"))
PHASES += ((0.35, 5, "at contact"), (0.85, 6, "command disconnect"), (0.9, 7, "command observation"))


class Synth:
    """Arrays of a run of `duration_s` at `rate_hz`; `write(folder)` makes the run folder."""

    def __init__(
        self,
        duration_s: float = 60.0,
        rate_hz: int = 10,
        error: tuple[float, float, float] = (0.1, -0.2, 0.3),
        wind_error: tuple[float, float, float] = (0.2, 0.0, -0.1),
        sigma: float = 0.1,
        noise: float = 0.0,
        seed: int = 1,
    ) -> None:
        rng = np.random.default_rng(seed)
        self.n = n = int(duration_s * rate_hz) + 1
        self.t_us = np.arange(n, dtype=np.int64) * (1_000_000 // rate_hz)
        self.frac = frac = self.t_us / self.t_us[-1]
        t = self.t_us * 1e-6
        self.turn = turn = (frac > 0.5) & (frac < 0.7)
        self.psi_dot = np.where(turn, np.radians(1.7), 0.0)
        psi = np.concatenate([[0.0], np.cumsum(self.psi_dot[:-1] * np.diff(t))])
        phi = np.where(turn, np.radians(28.0), 0.0)
        phi = np.convolve(np.pad(phi, 20, "edge"), np.ones(21) / 21, "same")[20:-20]
        theta = np.full(n, np.radians(3.0))
        self.q = [euler_quat(np.stack([psi, theta, phi], axis=1))]
        rel = np.stack([0.01 * np.sin(t / 3), -0.04 + 0 * t, 0.02 * np.sin(t / 2)], axis=1)
        self.q.append(quat_mul(self.q[0], euler_quat(rel)))
        V = 190.0
        vel = np.stack([V * np.cos(psi), V * np.sin(psi), 0 * t], axis=1)
        base = np.stack([7 + 2 * np.sin(t / 40), -13 + 2 * np.cos(t / 30), 0.3 * np.sin(t / 9)], axis=1)
        down = np.interp(frac, [0, 0.25, 0.35, 0.85, 0.9, 1], [-0.5, 1, 4.6, 4.6, 1, -0.5])
        self.wind = [base + noise * rng.standard_normal((n, 3)), base + np.stack([0 * t, 0 * t, down], axis=1)]
        self.wind[1] = self.wind[1] + noise * rng.standard_normal((n, 3))
        self.vel = [vel + base, vel + base]
        self.pos = [np.cumsum(self.vel[0], axis=0) / rate_hz + np.array([0.0, 0.0, -7010.0])]
        self.pos[0][:, 2] = -7010.0
        knots = np.array([OBSERVATION, OBSERVATION, PRECONTACT, PRECONTACT, CONTACT, CONTACT, PRECONTACT, OBSERVATION])
        at = [0, 0.1, 0.2, 0.25, 0.35, 0.85, 0.9, 1.0]
        self.cmd = np.stack([np.interp(frac, at, knots[:, i]) for i in range(3)], axis=1).astype(np.float32)
        self.cmd_vel = np.gradient(self.cmd, t, axis=0)
        self.xi = self.cmd.astype(np.float64) + np.array(error) + noise * 0.3 * rng.standard_normal((n, 3))
        self.pos.append(self.pos[0] + quat_rotate(self.q[0], self.xi))
        self.hat = [w + np.array(wind_error) for w in self.wind]
        self.sigma = sigma
        self.phase = np.array([[p[1] for p in PHASES if p[0] <= f][-1] for f in frac])
        self.reason = [[p[2] for p in PHASES if p[0] <= f][-1] for f in frac]
        self.measure = self.phase == 5
        self.euler = [np.stack([psi, theta, phi], axis=1), np.stack([psi, theta - 0.04, phi], axis=1)]

    def truth_packets(self) -> list[tuple[int, bytes]]:
        """(t_us, packet) of truth.tlog."""
        send = [Sender(1, 190), Sender(2, 190)]
        arm = self.xi + np.array([3.0, 0.0, -1.0]) - np.array([-21.943, 0.0, 1.405])
        length = np.linalg.norm(arm, axis=1)
        el, az = -np.arcsin(arm[:, 2] / length), np.arctan2(arm[:, 1], -arm[:, 0])
        out = []
        for k, t in enumerate(self.t_us):
            for i in range(2):
                out.append(
                    (
                        int(t),
                        send[i].named(
                            "TRUTH", time_usec=int(t), pos_n=self.pos[i][k], vel_n=self.vel[i][k], q_nb=self.q[i][k],
                            xi=self.xi[k] if i else (0.0, 0.0, 0.0), wind_n=self.wind[i][k], V=190.0, alpha=0.04,
                            controls=(0.01, -0.03, 0.0, 6500.0 if i else 70e3), mass=5000.0 if i else 120e3,
                            boom_elevation=el[k], boom_azimuth=az[k], boom_extension=length[k] - 8.53,
                            contact=bool(self.measure[k]), inside=bool(self.measure[k]),
                        ),
                    )
                )  # fmt: skip
        return out

    def telemetry(self, i: int) -> list[bytes]:
        """Datagrams of aircraft i (0 tanker, 1 receiver), one per sample."""
        send = Sender(i + 1, 1)
        out = []
        for k, t in enumerate(self.t_us.tolist()):
            e = self.euler[i][k]
            data = send.named(
                "NAV_STATE", time_usec=t, V=190.0, alpha=0.04, psi=e[0], theta=e[1], phi=e[2], wind=self.hat[i][k],
                wind_sigma=[self.sigma] * 3, nis=11.0, nis_dof=12, valid=1,
            )  # fmt: skip
            data += send.named("LOCAL_POSITION_NED", time_boot_ms=t // 1000, x=self.pos[i][k][0], z=self.pos[i][k][2])
            if i:
                pos = self.xi[k] + 0.05
                data += send.named(
                    "RELATIVE_STATE", time_usec=t, pos=pos, cmd_pos=self.cmd[k], cmd_vel=self.cmd_vel[k], sigma=[0.1] * 3,
                    valid=1,
                )  # fmt: skip
            phase = (11 if self.turn[k] else 10) if not i else int(self.phase[k])
            data += send.named(
                "MISSION_STATUS", time_usec=t, phase=phase, measure=int(bool(i) and self.measure[k]), cmd_V=190.0,
                cmd_alt=7010.0, cmd_psi_dot=self.psi_dot[k], elevator=-0.03, throttle=0.4,
                reason=self.reason[k] if i else "leg", contact=int(self.measure[k]),
            )  # fmt: skip
            if t % 1_000_000 == 0:
                data += send.named("LOOP_TIMING", time_usec=t, ticks=t // 10_000, slips=i * 2, exec_mean=300.0 + 20 * i)
                data += send.named("HEALTH_STATUS", time_usec=t)
            if k and self.phase[k] != self.phase[k - 1] and i:
                data += send.named("STATUSTEXT", severity=6, text=f"phase: {self.reason[k]}")
            out.append(data)
        return out

    def write(self, folder: Path) -> Path:
        """Run folder with truth.tlog, tlm.tlog and meta.json."""
        folder.mkdir(parents=True, exist_ok=True)
        truth = TlogWriter(folder / "truth.tlog")
        for t, packet in self.truth_packets():
            truth.write(t, packet)
        truth.close()
        tlm = TlogWriter(folder / "tlm.tlog")
        for t, a, b in zip(self.t_us.tolist(), self.telemetry(0), self.telemetry(1), strict=True):
            tlm.write_datagram(t, a)
            tlm.write_datagram(t, b)
        tlm.close()
        (folder / "meta.json").write_text(json.dumps({"run": {"outcome": "completed"}, "seed": 1}))
        return folder
