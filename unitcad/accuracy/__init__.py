"""The command `accuracy`: errors, bounds and run times of a spec, and the survey of random media and specs."""
