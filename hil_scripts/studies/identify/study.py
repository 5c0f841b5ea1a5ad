"""The campaign `identify`: coefficients identified from own flights against those flown, and how often the intervals hold
them."""

from __future__ import annotations

from hil_scripts.campaign.study import Case, Study
from hil_scripts.studies.identify.flight import pooled, run_case

STUDY = Study(
    name="identify",
    title="Identification from flights",
    purpose="the tanker with test inputs, each coefficient off from its file by up to 10 %: output error from the link log, 95 % "
    "intervals against what was drawn",
    cases=(
        Case("calm", {"sigma_mps": 0.0}),
        Case("light", {"sigma_mps": 0.39}),
    ),
    run=run_case,
    default_runs=20,
    pool=pooled,
)
