"""Records, catalogue and truths. Imports numpy and the standard library only."""
