"""Settings for every test: hypothesis draws the same examples each time and is not hurried by a loaded machine."""

from hypothesis import HealthCheck, settings

settings.register_profile("unitcad", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("unitcad")
