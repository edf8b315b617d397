"""The demo: an animal modelled here in code, with a rig, a clip, the maps of its fur, and a first coat."""

from core.demo.creature import Creature, demo_creature
from core.demo.document import demo_document

__all__ = ["Creature", "demo_creature", "demo_document"]
