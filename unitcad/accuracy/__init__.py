"""Error against run time, and what holds at the extremes: every table of docs/accuracy/ is computed here."""
