"""filters layer."""
