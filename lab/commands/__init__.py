"""The laboratory's commands of ``sitl``, one module each."""
