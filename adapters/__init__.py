"""Translations of a scene for each engine, the table of contestants, and the child processes they run in."""
