"""The level at a unit's edge: closed forms, what is fitted to the measured levels, and how well each does."""
