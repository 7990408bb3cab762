"""Many drives, or one for months: which log is whose and when, and which numbers change beyond chance."""
