"""The laws of the documents (R1-R14) and of Newton and Coulomb, the runners, and the reference as a contestant."""
