"""Trains, calibrates, exports and evaluates the project's own detector."""
