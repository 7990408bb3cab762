"""The commands, a module for each group of them; each is one Python call, imported when it is asked for."""
