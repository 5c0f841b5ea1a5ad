"""Air-data messages put into a run folder that has none: known errors against its truth, faults at known times.

The true position in air-path axes is made by scipy's rotations, not by the code under test.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from flightsw.icd.tlog import TlogWriter, read
from flightsw.icd.wire import SPECS, Counters, Sender, split
from ground.columns import Table, load

Fault = tuple[float, float, int, float]  # from [s], to [s], channel, size over the noise
COV = (0.04, 0.01, 0.09)  # [m^2] yy, yz, zz


def true_air_path(truth: Path) -> tuple[np.ndarray, np.ndarray]:
    """(t_us, position (n,3) [m]) of the receiver in the tanker's air-path axes."""
    log = load(truth)
    tables: list[Table] = []
    for sysid in (2, 1):
        table = log.get(sysid, "TRUTH")
        assert table is not None
        tables.append(table)
    rows, lead = tables
    t, i, j = np.intersect1d(rows.t_us, lead.t_us, return_indices=True)
    angles = np.stack([-lead["alpha"][j], lead["beta"][j]], axis=1).astype(np.float64)
    return t, Rotation.from_euler("YZ", angles).inv().apply(rows["xi"][i])


def messages(
    t_us: np.ndarray,
    place: np.ndarray,
    error: tuple[float, float] = (0.0, 0.0),
    noise: bool = False,
    faults: tuple[Fault, ...] = (),
    invalid: tuple[float, float] = (0.0, 0.0),
    threshold: float = 23.03,
    seed: int = 5,
) -> dict[int, bytes]:
    """t_us -> FDI_STATUS and WAKE_POSITION as one datagram. `error` y, z [m] of the position, plus correlated noise of
    covariance COV if asked for; invalid between the two times [s]; a fault excludes its channel from 0.1 s on until
    1 s after its end."""
    rng = np.random.default_rng(seed)
    send = Sender(2, 1)
    factor = np.linalg.cholesky([[COV[0], COV[1]], [COV[1], COV[2]]])
    basis = np.array([[np.sqrt(2 / 3), -np.sqrt(1 / 6), -np.sqrt(1 / 6)], [0.0, np.sqrt(0.5), -np.sqrt(0.5)]])
    drift = np.zeros(2)
    out, exclusions, was = {}, 0, 0
    for t, p in zip(t_us.tolist(), place, strict=True):
        s = t * 1e-6
        parity = rng.standard_normal((3, 2))
        isolated = negative = excluded = 0
        for start, end, channel, size in faults:
            if start <= s < end:
                parity[channel // 3] += size * basis[:, channel % 3]
                isolated |= 1 << channel
                negative |= (size < 0) << channel
            if start + 0.1 <= s + 1e-9 < end + 1.0:
                excluded |= 1 << channel
        exclusions += (excluded & ~was).bit_count()
        was = excluded
        gamma = (parity**2).sum(axis=1)
        alarm = sum(int(g > threshold) << i for i, g in enumerate(gamma))
        fdi = send.named(
            "FDI_STATUS", time_usec=t, gamma=gamma, threshold=threshold, residual=parity.ravel(), alarm=alarm,
            isolated=isolated if alarm else 0, negative=negative, excluded=excluded, exclusions=exclusions, valid=1,
        )  # fmt: skip
        drift = 0.98 * drift + np.sqrt(1 - 0.98**2) * rng.standard_normal(2)
        at = p + np.array([0.0, *error])
        if noise:
            at[1:] += factor @ drift
        good = not invalid[0] <= s < invalid[1]
        k = np.exp(-s / 20.0)
        wake = send.named(
            "WAKE_POSITION", time_usec=t, pos=at, cov=COV, scale=(1.0 - 0.1 * (1 - k), 1.0 - 0.4 * (1 - k)),
            scale_sigma=(0.02 + 0.08 * k, 0.1 + 0.4 * k), nis=rng.chisquare(9), nis_dof=9, valid=good,
            reason="" if good else "not observable",
        )  # fmt: skip
        out[t] = fdi + wake
    return out


def add_airdata(run: Path, **how: object) -> Path:
    """Put the messages into RUN/tlm.tlog at every NAV_STATE of the receiver (10 Hz)."""
    t, place = true_air_path(run / "truth.tlog")
    table = load(run / "tlm.tlog").get(2, "NAV_STATE")
    assert table is not None
    use = np.isin(t, table.t_us)
    extra = messages(t[use], place[use], **how)  # type: ignore[arg-type]
    records = list(read(run / "tlm.tlog"))
    writer = TlogWriter(run / "tlm.tlog")
    for stamp, link, packet in records:
        writer.write(stamp, packet, link)
        [found] = split(packet, SPECS, Counters())
        if found[0].name == "MISSION_STATUS" and found[2] == 2 and stamp in extra:
            writer.write_datagram(stamp, extra[stamp])
    writer.close()
    return run
