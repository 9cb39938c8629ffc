"""Pages that people look at: one HTML file with everything in it, which needs neither network nor server."""

from __future__ import annotations

from bingham.report.page import render_report, write_report

__all__ = ["render_report", "write_report"]
