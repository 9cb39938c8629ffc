"""Pages that people look at: one HTML file with everything in it, which needs neither network nor server."""

from __future__ import annotations

from bingham.report.page import Report, render_report, report_track, write_report
from bingham.report.rerun import write_rerun

__all__ = ["Report", "render_report", "report_track", "write_report", "write_rerun"]
