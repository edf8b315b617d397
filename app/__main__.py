"""``python -m app`` is ``filoplume``."""

from app.cli import main

main()
