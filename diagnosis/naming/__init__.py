"""Naming: what any system of FMUs lacks, found beside logs of it."""
