"""Moulds for any body: parted level or upright, in any pose; found by the core through `room.toml`."""
