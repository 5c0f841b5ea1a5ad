"""Campaigns: one study, many runs, in parallel, resumable; the result is a table and a summary in a folder."""

from __future__ import annotations

from hil_scripts.campaign.engine import Outcome, run_campaign
from hil_scripts.campaign.study import CampaignError, Case, RunResult, Study

__all__ = ["CampaignError", "Case", "Outcome", "RunResult", "Study", "run_campaign"]
