"""From a target to designs: everything at hand is tried, judged by its probability, its limits and its moulds."""
