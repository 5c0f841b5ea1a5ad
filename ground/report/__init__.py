"""Reports: campaign folders in, one self-contained HTML page and its figures out."""
