"""The voyage on record and on the radio: the folder a voyage leaves, its progress line, its summary."""
