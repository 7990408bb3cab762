"""Calibration: chosen numbers of any system of FMUs, fitted to logs, with what the logs tell of each.

The system is run as a whole from its open inputs, the FMUs themselves by the master, and every measured output is
compared. It stands above `systems`, whose reading of a rig and of its FMUs it shares, and is a folder of the diagnosis, not
a room of its own, because whatever names what is missing in such systems must be able to call it.

Why not lmfit, whose report ours reads like: of its fit only scipy's least_squares would be used. It has no fit from
several starts, takes a failed simulation for the end of the fit, and its intervals take errors for white noise, where those
of a simulation are not; its report is made from its own result. What of it would be left is the layout of the report.
"""
