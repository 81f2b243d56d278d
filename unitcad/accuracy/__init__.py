"""Error against run time, and what holds at the extremes: every table of docs/accuracy.md is computed here."""
