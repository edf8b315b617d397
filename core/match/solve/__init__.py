"""From tracks to cameras: bundle adjustment, first cameras, the whole solve, and what it says of itself."""
