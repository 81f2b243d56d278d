"""The lab's own data: recordings, tensile curves, dynamic tests, and the phantom that makes them comparable."""
