"""A run, or somebody else's log, in files that other people's tools read: Parquet, CSV, MCAP, ULog."""
