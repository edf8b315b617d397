"""Models from photographs: picks, their solve, and what is built upon them."""
