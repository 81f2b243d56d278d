"""One offline HTML page for what a folder holds: a variant, or a batch of them. It contacts nothing."""

from unitcad.report.page import write_report

__all__ = ["write_report"]
