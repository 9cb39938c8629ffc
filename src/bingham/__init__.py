"""Bingham distributions on unit hyperspheres and the recursive filters built on them."""

