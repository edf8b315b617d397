"""Tests of the editor of the feather."""
