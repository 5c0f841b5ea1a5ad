"""Files shipped with the plant; see README.md here."""
