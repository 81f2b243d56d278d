"""The level at a unit's edge: closed forms, fits to the measured levels, and their scores."""
