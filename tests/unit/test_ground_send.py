"""Commands over loopback sockets: accepted, refused, unanswered; the monitor's words."""

from __future__ import annotations

import runpy
import socket
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from flightsw import plugins
from flightsw.icd.texts import answer, text
from flightsw.icd.wire import SPECS, Counters, Sender, split
from flightsw.missions.base import MissionSpec
from flightsw.types import Ack
from ground.__main__ import app
from ground.link.command import COMP_PLANT, Answer, CommandError, Order, offered, order, send
from ground.link.command import MISSIONS as GROUND_MISSIONS
from ground.link.inject import CHANNELS, PROBES, TYPES, UNITS, inject
from ground.link.live import STALE_S, Monitor, wind_words
from ground.link.packets import health_words

Synth = runpy.run_path(str(Path(__file__).with_name("ground_synth.py")))["Synth"]
Reply = Callable[[dict[str, float]], list[bytes]]
TANKER_MISSION, RECEIVER_MISSION, GUST_MISSION, JET_MISSION = 1, 2, 5, 6  # WKF_MISSION

MISSIONS = plugins.parts(plugins.MISSIONS, MissionSpec)


class Aircraft:
    """Answers COMMAND_LONG on an ephemeral port with what `reply` says; keeps what it heard. Asked for AUTOPILOT_VERSION it
    says its mission (0: refuses to)."""

    def __init__(self, reply: Reply, mission: int = RECEIVER_MISSION, sysid: int = 2) -> None:
        self.reply, self.mission, self.sysid = reply, mission, sysid
        self.heard: list[dict[str, float]] = []
        self.sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.sock.bind(("127.0.0.1", 0))
        self.port = self.sock.getsockname()[1]
        self.thread = threading.Thread(target=self._serve, daemon=True)
        self.thread.start()

    def _serve(self) -> None:
        while True:
            data, who = self.sock.recvfrom(65536)
            if not data:
                return
            for spec, values, *_ in split(data, SPECS, Counters()):
                c = spec.to_dict(values)
                if c["command"] == 512:
                    packets = self._version()
                else:
                    self.heard.append(c)
                    packets = self.reply(c)
                for packet in packets:
                    self.sock.sendto(packet, who)

    def _version(self) -> list[bytes]:
        send = Sender(self.sysid, 1)
        if not self.mission:
            return [ack(3, command=512, sysid=self.sysid)]
        return [ack(0, command=512, sysid=self.sysid), send.named("AUTOPILOT_VERSION", product_id=self.mission)]

    def close(self) -> None:
        """End the thread by an empty datagram."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
            s.sendto(b"", ("127.0.0.1", self.port))
        self.thread.join()
        self.sock.close()


def ack(result: int, command: int = 31010, sysid: int = 2, to: int = 255) -> bytes:
    """A COMMAND_ACK."""
    return Sender(sysid, 1).named("COMMAND_ACK", command=command, result=result, target_system=to)


def ask(
    reply: Reply, what: Order, attempts: int = 4, retry_s: float = 2.0, mission: int = RECEIVER_MISSION, sysid: int = 2
) -> tuple[int, str, list[dict[str, float]]]:
    """Exit code, text and what the aircraft heard."""
    aircraft = Aircraft(reply, mission, sysid)
    try:
        answer = send(what, port=aircraft.port, attempts=attempts, retry_s=retry_s)
    finally:
        aircraft.close()
    return answer.exit_code, answer.text, aircraft.heard


def test_accepted() -> None:
    code, text, heard = ask(lambda _: [ack(0)], order("contact", None, None))
    assert code == 0
    assert "accepted" in text
    assert len(heard) == 1
    assert heard[0]["command"] == 31010
    assert heard[0]["param1"] == 3.0
    assert heard[0]["target_system"] == 2


def test_refused_says_why() -> None:
    code, text, _ = ask(lambda _: [ack(1)], order("contact", None, None))
    assert code == 1
    assert "refused" in text
    assert "TEMPORARILY_REJECTED" in text


@pytest.mark.parametrize("length", [0, 12, 49, 50, 51, 100, 170])
def test_the_reason_of_a_refusal_is_printed_whole(length: int) -> None:
    """The text the ACK names, in chunks, among texts of other things."""
    why = ("pre-contact: station error 125.0 m, allowed 4; " * 4)[:length]
    send_ = Sender(2, 1)

    def reply(_: dict[str, float]) -> list[bytes]:
        other = text(send_, 6, "something else")
        return [other, b"".join([answer(send_, Ack(31010, 1, 255, 190, why)), other])]

    code, words, _ = ask(reply, order("precontact", None, None))
    assert code == 1 and words.endswith(f"TEMPORARILY_REJECTED: {why}" if why else "TEMPORARILY_REJECTED")


def test_a_foreign_autopilots_reason_is_the_text_beside_its_answer() -> None:
    said = Sender(2, 1).named("STATUSTEXT", severity=4, text="PreArm: no")
    code, words, _ = ask(lambda _: [said + ack(2)], order("hold", None, None), mission=0)
    assert code == 1 and words.endswith("DENIED: PreArm: no")


@pytest.mark.parametrize(
    ("action", "value", "mission", "words"),
    [
        ("hold", None, GUST_MISSION, "hold: of receiver, receiver_rendezvous; this aircraft flies gust: not sent"),
        ("contact", None, JET_MISSION, "this aircraft flies windshear"),
        ("go-around", None, RECEIVER_MISSION, "go-around: of windshear; this aircraft flies receiver"),
        ("speed", 195.0, RECEIVER_MISSION, "speed 195 m/s: of tanker, rendezvous"),
        ("law", 0.0, TANKER_MISSION, "law 0: of gust, windshear; this aircraft flies tanker"),
        ("law", 4.0, GUST_MISSION, "law 4: gust has 0 hold, 1 alleviation, 2 elevator"),
        ("law", 0.0, 0, "does not say what it flies"),
    ],
)
def test_an_order_of_another_mission_is_refused_by_name_and_not_sent(
    action: str, value: float | None, mission: int, words: str
) -> None:
    code, text_, heard = ask(lambda _: [ack(0)], order(action, value, 2), mission=mission)
    assert code == 1 and words in text_ and heard == []


@pytest.mark.parametrize(
    ("mission", "command", "name"), [(GUST_MISSION, 31011, "hold"), (JET_MISSION, 31012, "managed")]
)
def test_the_law_is_the_one_of_the_mission_flown(mission: int, command: int, name: str) -> None:
    code, words, heard = ask(lambda c: [ack(0, int(c["command"]), 3)], order("law", 0.0, 3), mission=mission, sysid=3)
    assert code == 0 and f"law {name}: accepted" in words
    assert [(c["command"], c["param1"]) for c in heard] == [(command, 0.0)]


def test_owners_are_the_missions_own_commands() -> None:
    taken = {name: cls.commands for name, cls in MISSIONS.items()}
    offers = [c for choice in offered().values() for c in choice]
    for c in offers:
        assert set(c.missions) == {name for name, own in taken.items() if c.command in own}, c.word
    assert set().union(*taken.values()) == {c.command for c in offers}
    assert sorted(GROUND_MISSIONS.values()) == sorted(taken)


def test_lost_command_is_repeated_with_rising_confirmation() -> None:
    code, _, heard = ask(lambda c: [ack(0)] if c["confirmation"] == 2 else [], order("hold", None, None), retry_s=0.1)
    assert code == 0
    assert [c["confirmation"] for c in heard] == [0, 1, 2]


def test_unanswered_in_bounded_attempts() -> None:
    code, text, heard = ask(lambda _: [], order("hold", None, None), attempts=3, retry_s=0.05)
    assert code == 2
    assert "no answer from receiver" in text
    assert len(heard) == 3


def test_nobody_there_at_all() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
        s.bind(("127.0.0.1", 0))
        port = s.getsockname()[1]
    got = send(order("hold", None, None), port=port, attempts=2, retry_s=0.05)
    assert got.exit_code == 2


def test_answers_to_others_and_rubbish_do_not_count() -> None:
    def reply(_: dict[str, float]) -> list[bytes]:
        return [b"rubbish", ack(1, command=178), ack(1, sysid=1), ack(1, to=42), ack(0)]

    code, text, _ = ask(reply, order("breakaway", None, None))
    assert code == 0, text


def test_in_progress_waits_for_the_end() -> None:
    code, text, _ = ask(lambda _: [ack(5), ack(4)], order("contact", None, None))
    assert code == 1
    assert "FAILED" in text


def test_speed_goes_to_the_tanker() -> None:
    what = order("speed", 195.0, None)
    assert (what.target, what.command, what.params[1]) == (1, 178, 195.0)
    assert order("speed", 195.0, 2).target == 2


@pytest.mark.parametrize(
    ("action", "value", "words"),
    [("dance", None, "unknown action 'dance'"), ("speed", None, "needs a value"), ("speed", -3.0, "greater than 0"),
     ("speed", float("nan"), "greater than 0"), ("hold", 3.0, "takes no value")],
)  # fmt: skip
def test_bad_orders_are_named(action: str, value: float | None, words: str) -> None:
    with pytest.raises(CommandError, match=words):
        order(action, value, None)


def test_failure_goes_to_the_plant_and_its_answer_counts() -> None:
    what = inject(-0.0175, "bias", probe="left", channel="beta", for_s=30.0)
    done = Sender(2, COMP_PLANT).named("COMMAND_ACK", command=420, result=0, target_system=255)
    code, text, heard = ask(lambda _: [ack(1, command=420), done], what)
    assert code == 0, text
    assert "the plant for receiver" in text and "wrong" in text
    assert (heard[0]["command"], heard[0]["target_system"], heard[0]["target_component"]) == (420, 2, 190)
    assert [heard[0][f"param{i}"] for i in range(1, 8)] == pytest.approx([8, 4, 2, 3, -0.0175, 30, 0])


def test_unanswered_failure_names_the_plants_port() -> None:
    got = send(inject(None, "off", probe="1"), port_offset=40_000, attempts=1, retry_s=0.05)
    assert got.exit_code == 2
    assert "the plant for receiver" in got.text and "54590" in got.text


def test_failure_words_and_numbers() -> None:
    assert inject(0.01, "drift").params[:5] == (8.0, 5.0, 0.0, 0.0, 0.01)
    assert inject(0.01, "5", "8", "0", "0").params == inject(0.01, "slow").params
    assert inject(None, "clear").params[1] == 0.0
    assert inject(None, "bias", channel="V").params[4] == 0.0  # the plant's default
    assert inject(None, "stuck", channel="v").params[3] == 1.0
    assert inject(None, "off", to=1).target == 1
    assert CHANNELS == {"all": 0, "V": 1, "alpha": 2, "beta": 3}
    assert PROBES == {"all": 0, "nose": 1, "left": 2, "right": 3}
    assert UNITS["airspeed"] == 8 and TYPES["intermittent"] == 7 and len(TYPES) == 17


@pytest.mark.parametrize(
    ("args", "words"),
    [((1.0, ""), "unknown type ''"), ((1.0, "melt"), "known: ok, off, stuck"),
     ((1.0, "off"), "takes no value"), ((float("nan"), "bias"), "not a finite number"),
     ((1.0, "bias", "airspeed", "tail"), "unknown probe 'tail'"), ((1.0, "bias", "airspeed", "all", "q"), "unknown channel"),
     ((1.0, "bias", "engine"), "unknown unit"), ((1.0, "bias", "airspeed", "all", "all", -1.0), "0 .until cleared. or more")],
)  # fmt: skip
def test_bad_failures_are_named(args: tuple[object, ...], words: str) -> None:
    with pytest.raises(CommandError, match=words):
        inject(*args)  # type: ignore[arg-type]


def test_negative_value_on_the_command_line_is_a_value(monkeypatch: pytest.MonkeyPatch) -> None:
    sent: list[Order] = []

    def transmit(what: Order, port_offset: int, host: str, **_: object) -> Answer:
        sent.append(what)
        return Answer(0, "done")

    monkeypatch.setattr("ground.link.command.send", transmit)
    line = ["send", "inject", "-0.02", "--type", "bias", "--probe", "right", "--channel", "alpha", "--for", "5"]
    assert CliRunner().invoke(app, line).exit_code == 0
    assert sent[0].params == (8.0, 4.0, 3.0, 2.0, -0.02, 5.0, 0.0)
    assert CliRunner().invoke(app, ["send", "hold", "--type", "bias"]).exit_code == 2
    assert CliRunner().invoke(app, ["send", "inject", "--typo", "bias"]).exit_code == 2


def test_actions_are_the_dialects() -> None:
    expected = ("hold", "precontact", "contact", "disconnect", "breakaway", "observation")
    assert [order(word, None, None).params[0] for word in expected] == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    r = CliRunner().invoke(app, ["send", "list"])
    assert r.exit_code == 0 and "law: gust; 0 hold, 1 alleviation, 2 elevator, 3 other; name an aircraft" in r.stdout
    assert "speed: tanker, rendezvous; m/s; usual sysid 1" in r.stdout


def test_monitor_shows_both_and_says_when_a_stream_stops() -> None:
    now = [100.0]
    monitor = Monitor(clock=lambda: now[0])
    now[0] += 3.0
    assert monitor.lines() == ["no data for 3 s"]
    synth = Synth(duration_s=10.0)
    for datagram in synth.telemetry(0)[:60] + synth.telemetry(1)[:60]:
        monitor.take(datagram)
    monitor.take(b"junk")
    tanker, receiver = monitor.lines()
    assert tanker.startswith("tanker: phase ")
    assert "phase CONTACT" in receiver
    assert "speed 190.0 m/s" in receiver
    assert "altitude 7010 m" in tanker
    assert "error +0.15 -0.15 +0.35 m" in receiver
    assert "no data" not in receiver
    assert monitor.junk == 1
    now[0] += STALE_S + 5.0
    assert "no data for 7 s" in monitor.lines()[1]
    assert monitor.screen() is not None


def test_words() -> None:
    assert health_words(0) == "ok"
    assert health_words(2 | 32) == "GNSS PEER"
    assert wind_words([0.0, -10.0, 1.0], [0.1, 0.2, 0.1]) == "10.0 m/s from 090, down +1.0 (3 sigma 0.6)"
