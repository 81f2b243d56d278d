"""unitcad: haptic units, their casting moulds and an attenuation estimate, from a short TOML spec.

Importing this package reads no file and loads no CAD library.
"""

__version__ = "0.1.0"
