"""The whole way for a drive: replay, diagnosis, and the chance of a search."""
