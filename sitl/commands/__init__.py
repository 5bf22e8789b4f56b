"""The commands of ``sitl``, one module each."""
