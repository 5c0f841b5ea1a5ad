"""Campaigns: one study, many runs, in parallel, resumable; the result is a table and a summary in a folder.

`study` holds what a study module needs (Study, Case, RunResult), `engine` the function `run_campaign`. Nothing is imported
here: the command line sets the number of numerical threads before numpy is loaded.
"""
