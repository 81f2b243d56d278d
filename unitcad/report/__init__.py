"""One offline HTML page for what a folder holds: a variant, or a batch of them. It contacts nothing."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from unitcad.report.page import write_report as write_report

__all__ = ["write_report"]


def __getattr__(name: str) -> object:
    """Load the page's writer when it is first used: what gives a page its models needs none. Raises AttributeError."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from unitcad.report import page

    return page.write_report
