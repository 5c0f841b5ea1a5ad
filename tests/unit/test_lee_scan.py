"""The scan of the printed method's free numbers: the window of the calculated wind is most of what was held against it."""

from __future__ import annotations

import pytest

from hil_scripts.campaign.study import Case
from hil_scripts.studies.lee import scan


def test_window_of_one_sample_is_right_about_itself_where_41_are_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scan, "WINDOWS", (1, 41))
    monkeypatch.setattr(scan, "ROOTS", (0.33,))
    v = scan.run_scan(Case("III", {"wind": "ecwm", "noise": "large", "duration_s": 90.0, "after_s": 30.0}), 4).values
    one, many = ({k: v[f"w{n}_q0p33.{k}"] for k in scan.FIGURES} for n in (1, 41))
    assert one["wind.inside_3sigma_pct"] > 95.0 > many["wind.inside_3sigma_pct"]
    assert one["nees.wind_mean"] < 0.3 * many["nees.wind_mean"]
    # and the extended filter does not diverge on the same equations, readings and noise
    assert v["ekf.wind.magnitude_rms_pct"] == pytest.approx(one["wind.magnitude_rms_pct"], rel=0.3)
