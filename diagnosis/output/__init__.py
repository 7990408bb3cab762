"""Figures, report, extended FMUs and the system that plays a log with them."""
