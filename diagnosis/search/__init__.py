"""Forward selection: hypotheses, a first linear look, fits, and what each leaves on blocks that it did not see."""
