"""What a selection is worth on data that it did not see: dependences, gain, verdict, the time step."""
