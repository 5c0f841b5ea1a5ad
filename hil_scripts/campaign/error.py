"""What every part of a campaign raises; apart, so that naming the studies imports nothing else."""

from __future__ import annotations


class CampaignError(ValueError):
    """Bad input or a folder, cluster or study that cannot be used; the text says which and what is allowed."""
