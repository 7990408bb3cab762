"""Any system of FMUs on a log: parts of it on measured inputs, and which of them is to blame."""
