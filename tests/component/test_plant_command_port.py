"""A ground station that knows only the stock MAVLink dialect makes a probe fail over UDP, in lockstep and in real time."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import common as stock

from flightsw.icd.codec import FlightCodec
from flightsw.icd.link import LinkError, UdpLink, plant_command_port, plant_port
from flightsw.icd.tlog import read
from flightsw.icd.wire import SPECS, Counters, Sender, split
from flightsw.types import ActuatorCmd, SensorFrame
from sim_plant.failures.desk import COMMANDS_MAX
from sim_plant.loops import UdpPlant
from sim_plant.scenario import load_scenario
from sim_plant.server import PlantServer


class Flight:
    """Stands for one flightsw on its UDP port: answers with the trim command; `before(k)` runs before answer k."""

    def __init__(
        self,
        s: PlantServer,
        i: int,
        offset: int,
        before: Callable[[int], None] | None = None,
        deaf: set[int] | None = None,  # ticks whose first datagram gets lost
    ) -> None:
        v = s.world.members[i]
        self.deaf = deaf or set()
        self.codec, self.cmd, self.before = FlightCodec(v.ac, v.cfg.sysid), s.world.trim_cmd(i), before
        self.masks: dict[int, int] = {}  # tick -> mask of the air data that came with it
        self.sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.sock.bind(("127.0.0.1", plant_port(s.sysids[i], offset)))
        self.sock.settimeout(0.2)
        self.stop = False
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def _run(self) -> None:
        frame, c = SensorFrame(), self.cmd
        while not self.stop:
            try:
                data, addr = self.sock.recvfrom(65535)
            except TimeoutError:
                continue
            self.codec.decode(data, frame)
            k = frame.t_us // 10_000
            if k in self.deaf:
                self.deaf.remove(k)
                continue
            if frame.updated & 16:
                self.masks.setdefault(k, frame.air_mask)
            if self.before is not None:
                self.before(k)
            out = self.codec.actuators(ActuatorCmd(frame.t_us, c.aileron, c.elevator, c.rudder, c.throttle))
            self.sock.sendto(out, addr)

    def close(self) -> None:
        self.stop = True
        self.thread.join()
        self.sock.close()


class StockGround:
    """pymavlink's own encoder and parser of the common dialect over a plain socket."""

    def __init__(self, offset: int) -> None:
        self.sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.sock.connect(("127.0.0.1", plant_command_port(offset)))
        self.sock.settimeout(5.0)
        self.mav = stock.MAVLink(None, srcSystem=255, srcComponent=190)

    def send(self, unit: int, kind: int, instance: int) -> None:
        """MAV_CMD_INJECT_FAILURE as the standard has it: reserved parameters zero."""
        m = self.mav.command_long_encode(2, 0, stock.MAV_CMD_INJECT_FAILURE, 0, unit, kind, instance, 0, 0, 0, 0)
        self.sock.send(m.pack(self.mav))

    def ack(self) -> tuple[int, int]:
        """(command, result) of the next COMMAND_ACK."""
        *said, m = self.mav.parse_buffer(self.sock.recv(65535))
        assert all(t.get_type() == "STATUSTEXT" and t.id == m.result_param2 for t in said)
        assert bool(said) == (m.result != stock.MAV_RESULT_ACCEPTED)  # a refusal says why
        assert m.get_type() == "COMMAND_ACK" and m.get_srcSystem() == 2 and m.target_system == 255
        return m.command, m.result


def run(offset: int, folder: Path, mode: str, orders: dict[int, tuple[int, int, int]]) -> tuple[Flight, StockGround]:
    """Fly two seconds; order {tick: (unit, type, instance)} goes out before the receiver answers that tick."""
    s = PlantServer(load_scenario("refueling", {"meta.duration_s": 2.0, "clock.mode": mode}), 1, folder)
    plant, ground = UdpPlant(s, offset, lambda *_: None, lambda text: None), StockGround(offset)
    todo = dict(orders)

    def before(k: int) -> None:
        if (o := todo.pop(k, None)) is not None:
            ground.send(*o)

    peers = [Flight(s, 0, offset), Flight(s, 1, offset, before)]
    try:
        plant.realtime() if mode == "realtime" else plant.lockstep()
    finally:
        plant.finish()
        s.close()
        for p in peers:
            p.close()
    return peers[1], ground


OFF, OK = stock.FAILURE_TYPE_OFF, stock.FAILURE_TYPE_OK
AIR = stock.FAILURE_UNIT_SENSOR_AIRSPEED


def test_lockstep(port_offset: int, tmp_path: Path) -> None:
    """Sent while tick 62 is open: done at tick 63, so the sample of tick 65 is the first without the probe."""
    orders = {
        62: (AIR, OFF, 2),
        100: (stock.FAILURE_UNIT_SENSOR_OPTICAL_FLOW, OFF, 0),
        130: (AIR, OK, 2),
        150: (AIR, OFF, 5),
    }
    flight, ground = run(port_offset, tmp_path, "lockstep", orders)
    assert [ground.ack() for _ in orders] == [
        (420, stock.MAV_RESULT_ACCEPTED),
        (420, stock.MAV_RESULT_UNSUPPORTED),
        (420, stock.MAV_RESULT_ACCEPTED),
        (420, stock.MAV_RESULT_DENIED),
    ]
    assert len(flight.masks) == 40
    assert flight.masks == {k: 5 if 63 <= k < 131 else 7 for k in range(0, 200, 5)}
    assert [t for t, _, _ in read(tmp_path / "plant.tlog")][::3] == [630_000, 1_010_000, 1_310_000, 1_510_000]


def test_real_time(port_offset: int, tmp_path: Path) -> None:
    flight, ground = run(port_offset, tmp_path, "realtime", {50: (AIR, OFF, 1)})
    assert ground.ack() == (420, stock.MAV_RESULT_ACCEPTED)
    (t_us,) = {t for t, _, _ in read(tmp_path / "plant.tlog")}
    assert t_us >= 500_000
    assert all(m == (6 if k * 10_000 >= t_us else 7) for k, m in flight.masks.items()) and 6 in flight.masks.values()


def test_a_lost_datagram_is_repeated_in_lockstep(port_offset: int, tmp_path: Path) -> None:
    """What a flood may do to the kernel's queue: the aircraft never sees some ticks at first."""
    s = PlantServer(load_scenario("refueling", {"meta.duration_s": 0.6}), 1, tmp_path)
    plant = UdpPlant(s, port_offset, lambda *_: None, lambda text: None)
    peers = [Flight(s, 0, port_offset), Flight(s, 1, port_offset, deaf={7, 31})]
    try:
        plant.lockstep()
    finally:
        plant.finish()
        s.close()
        for p in peers:
            p.close()
    assert peers[1].deaf == set() and s.tick == 60


def test_a_storm_of_commands_costs_a_tick_a_bounded_share(tmp_path: Path) -> None:
    s = PlantServer(load_scenario("refueling", {"meta.duration_s": 2.0}), 1, tmp_path)
    ask = Sender(255, 190).named("COMMAND_LONG", target_system=2, command=512, param1=30.0)
    s.begin_tick()
    got = [p for _ in range(50) for p in s.desk.take(ask * 40)]
    assert len(got) == COMMANDS_MAX and s.desk.unread == 50
    s.end_tick([None, None])
    s.begin_tick()
    [one] = s.desk.take(ask)  # the next tick has time again
    texts = [x[0].to_dict(x[1]) for x in split(one, SPECS, Counters())]
    assert texts[0]["text"].startswith("command 512: the plant takes 420") and texts[-1]["result"] == 3
    s.close()


def test_command_int_is_answered(tmp_path: Path) -> None:
    """An injection has values in SI, which integers cannot carry."""
    s = PlantServer(load_scenario("refueling", {"meta.duration_s": 2.0}), 1)
    for command, result in ((420, stock.MAV_RESULT_COMMAND_LONG_ONLY), (400, stock.MAV_RESULT_UNSUPPORTED)):
        [one] = s.desk.take(Sender(255, 190).named("COMMAND_INT", target_system=2, command=command, param1=8.0))
        *said, ack = [x[0].to_dict(x[1]) for x in split(one, SPECS, Counters())]
        assert ack["result"] == result and "COMMAND_LONG" in "".join(t["text"] for t in said)
    assert s.desk.take(Sender(255, 190).named("COMMAND_INT", target_system=9, command=420)) == []
    s.close()


def test_a_busy_port_is_named(port_offset: int) -> None:
    s = PlantServer(load_scenario("refueling"), 1)
    taken = UdpLink(plant_command_port(port_offset), "test")
    with pytest.raises(LinkError, match=rf"{taken.port} \(commands to the plant\) is already in use"):
        UdpPlant(s, port_offset, lambda *_: None, lambda text: None)
    taken.close()
