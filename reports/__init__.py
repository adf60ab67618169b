"""From trajectories to what a person or a CI job reads: measures, comparison, checks, renderers, command line."""
