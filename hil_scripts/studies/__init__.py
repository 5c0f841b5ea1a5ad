"""Published experiments as campaign definitions: each module offers STUDY or STUDIES for `sil campaign`."""
