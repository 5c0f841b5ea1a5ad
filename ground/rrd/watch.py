"""`ground live --rerun`, `--web`: a picture of a flight while it flies, in a process of its own the flight does not wait for.

Datagrams are taken as they come; at `rate_hz` what has come is drawn and sent, less often where that would take more than
`SHARE` of a core. A viewer that does not keep up gets no more until it has taken what it has; what then is too old is left out. A
viewer that goes away is waited for, one of ours started again, and gets all that the run folder has.
"""

from __future__ import annotations

import json
import math
import os
import select
import signal
import socket
import sys
import time
from pathlib import Path
from typing import TextIO

from flightsw.icd.overrun import overrun
from flightsw.icd.signing import Signing
from ground.rrd.flow import Flow, Picture
from ground.rrd.viewer import NICE, Viewer
from ground.window import Tail, Telemetry

RATE_HZ = 10.0  # batches, of wall time; a scene moves with each, plots grow with every tenth
WAIT_S = 0.025  # [s] for datagrams, between looks at the time
SHARE = 0.4  # of a core, at most
STATUS_S = 1.0  # [s] wall time between status lines
FLUSH_S = 2.0  # [s] a viewer has to take a batch
OVER_S = 3.0  # [s] without news after which a flight counts as over
RETRY_S = 1.0  # [s] between looks for a viewer
FAULTS = 20  # of views that are said
STARTS = 5  # of a viewer that ends again and again


class Watch:
    """One flight, or one after the other, in one viewer."""

    def __init__(
        self,
        viewer: Viewer,
        folder: Path | None,
        sock: socket.socket | None,
        rate_hz: float,
        status: TextIO | None,
        signing: Signing | None = None,
    ) -> None:
        self.period_s = 1.0 / rate_hz
        self.viewer, self.folder, self.sock, self.status = viewer, folder, sock, status
        self.signing = signing
        self.flow = Flow(folder, by_log=sock is None, signing=signing)
        self.picture: Picture | None = None
        self.runs = self.batches = self.held_up = 0
        self._anew = False
        self._news_at = self._next = self._said = self._tried = -math.inf
        self._reached = -1
        self._finished = False
        self.failed: set[str] = set()  # what views failed with, each said once

    # --- the viewer ---------------------------------------------------------------------------------------------------
    def _connected(self, now: float) -> bool:
        """A picture to draw in, made if the viewer is there."""
        if now - self._tried < RETRY_S and (self.picture is None or self.batches % 10):
            return self.picture is not None
        self._tried = now
        if self.viewer.there:
            if self.picture is None and self.flow.names and self.flow.end_us:
                self.runs += self.runs == 0
                self.picture = Picture.sent_to(self.flow, self._title(), self.viewer.url)
                self.picture.catch_up()
            return self.picture is not None
        if self.picture is not None:
            self._say(f"viewer went away at t = {self.flow.end_us * 1e-6:.1f} s")
            self.picture.close()
            self.picture = None
        ours = self.viewer.command and (self.viewer.own is None or self.viewer.page)
        if ours and self.viewer.starts < STARTS and (self.viewer.own is None or self.viewer.own.poll() is not None):
            self.viewer.start(binding=bool(self.viewer.page))
        return False

    def _title(self) -> str:
        name = self.folder.resolve().name if self.folder else "live"
        return name if self.runs < 2 else f"{name} {self.runs}"

    # --- the flight ---------------------------------------------------------------------------------------------------
    def pump(self, wait_s: float) -> None:
        """Take datagrams for a time [s]."""
        if self.sock is None:
            time.sleep(max(0.0, wait_s))
            return
        assert isinstance(self.flow.tlm, Telemetry)
        end = time.monotonic() + wait_s
        while (left := end - time.monotonic()) > 0.0:
            if not select.select([self.sock], [], [], left)[0]:
                return
            for _ in range(2000):
                try:
                    self.flow.tlm.take(self.sock.recv(65536))
                except BlockingIOError:
                    break
                except OSError:
                    continue

    def _restart(self) -> None:
        """The aircraft fly another run: a recording of its own."""
        self._say("aircraft have started again")
        self.runs += 1
        self.flow = Flow(self.folder, by_log=self.sock is None, signing=self.signing)
        if self.picture is not None:
            self.picture.close()
        self.picture, self._finished, self._reached = None, False, -1
        self._tried = -math.inf

    def step(self) -> None:
        """One batch, if it is time."""
        now = time.monotonic()
        if now < self._next:
            return
        began = time.process_time()
        self._anew |= self.flow.take()
        if isinstance(self.flow.tlm, Telemetry) and self.flow.tlm.restarted:
            self._restart()
            return
        if self.flow.end_us > self._reached:
            self._reached, self._news_at, self._finished = self.flow.end_us, now, False
        over = now - self._news_at > OVER_S
        if self._connected(now) and not (over and self._finished):
            assert self.picture is not None
            if self._anew:
                self.picture.lay_out()
                self._anew = False
            if self.picture.flush(FLUSH_S):
                self.picture.batch(last=over)
                self.batches += 1
                self._finished = over
            else:
                self.held_up += 1
        self._name_failed()
        cost = time.process_time() - began
        self._next = now + max(self.period_s, cost / SHARE)
        if now - self._said > STATUS_S:
            self._said = now
            self._say()

    # --- words --------------------------------------------------------------------------------------------------------
    def _name_failed(self) -> None:
        """Say of every view that failed, once, with what; it is asked again all the same."""
        for text in dict.fromkeys(self.flow.failed):
            if text not in self.failed and len(self.failed) < FAULTS:
                self.failed.add(text)
                self._say(text)
        self.flow.failed.clear()

    def accounts(self) -> dict[str, object]:
        """How far it is, what was sent and what was left out."""
        tlm = self.flow.tlm
        heard = isinstance(tlm, Telemetry)
        return {
            "t": round(self.flow.end_us * 1e-6, 2),
            "batches": self.batches,
            "rows": self.picture.sink.sent if self.picture else 0,
            "lost_packets": sum(tlm.stretch.dropped.values()),
            "overrun_datagrams": overrun(self.sock) if self.sock else 0,
            "skipped_packets": tlm.skipped if isinstance(tlm, Telemetry) else 0,
            "skipped_bytes": sum(t.skipped for t in self.flow.every.values() if isinstance(t, Tail)),
            "junk_packets": tlm.junk if heard else 0,  # type: ignore[union-attr]
            "refused_by_signing": 0 if self.signing is None else self.signing.refused.total,
            "held_up": self.held_up,
        }

    def _say(self, text: str = "") -> None:
        if self.status is None:
            return
        said = self.accounts()
        try:
            if self.status.isatty():
                words = text or f"t = {said['t']} s  {said['rows']} rows  left out: " + ", ".join(
                    f"{v} {k.replace('_', ' ')}" for k, v in said.items() if v and k not in ("t", "batches", "rows")
                )
                print(
                    f"\r\033[K{words.removesuffix('  left out: ')}",
                    end="\n" if text else "",
                    file=self.status,
                    flush=True,
                )
            else:
                print(json.dumps({"watch": said} | ({"text": text} if text else {})), file=self.status, flush=True)
        except (BrokenPipeError, ValueError):
            self.status = None


def _ended(_signum: int, _frame: object) -> None:
    raise KeyboardInterrupt


def watch(
    viewer: Viewer,
    folder: Path | None,
    sock: socket.socket | None,
    rate_hz: float = RATE_HZ,
    for_s: float | None = None,
    signing: Signing | None = None,
) -> int:
    """Draw until Ctrl-C, a termination signal or for `for_s` [s], with status lines on stdout; returns the exit code: 1 if
    nothing was ever heard, or a view failed."""
    os.nice(NICE)
    signal.signal(signal.SIGTERM, _ended)
    it = Watch(viewer, folder, sock, rate_hz, sys.stdout, signing)
    end = math.inf if for_s is None else time.monotonic() + for_s
    try:
        while time.monotonic() < end:
            it.pump(WAIT_S)
            it.step()
    except KeyboardInterrupt:
        return 130
    finally:
        if it.picture is not None:
            it.picture.close()
        if viewer.page:
            viewer.stop()
    return 0 if it.flow.end_us and not it.failed else 1
