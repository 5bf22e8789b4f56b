"""What `companion run` does before it sails: alone with the boat, whether to sail again, the drawing that is read."""

from companion.commands.starting.alone import alone, asked
from companion.commands.starting.drawn import Sailed, read_drawn, settings_of

__all__ = ["Sailed", "alone", "asked", "read_drawn", "settings_of"]
