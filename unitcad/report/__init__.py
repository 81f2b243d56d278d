"""One offline HTML page for a folder's variant or batch. It contacts nothing."""

from unitcad.report.page import write_report

__all__ = ["write_report"]
