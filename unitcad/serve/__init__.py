"""The live page: a server on this machine's loopback address, and the workers that answer it."""
