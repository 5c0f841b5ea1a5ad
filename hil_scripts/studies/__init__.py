"""Published experiments as campaign definitions, one folder per work, for `sil campaign`: entry points `wakefield.studies`."""
