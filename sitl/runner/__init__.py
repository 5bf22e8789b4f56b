"""The runner: seeded jobs over processes or a Dask cluster, and the file in which each result stays as it comes."""

from sitl.runner.cargo import Cargo, file_hash
from sitl.runner.identity import MadeBy, made_by
from sitl.runner.ledger import Held, Key, Ledger, read_results
from sitl.runner.processes import WorkerDiedError, in_processes, settled
from sitl.runner.sailing import Sailed, sail

__all__ = [
    "Cargo", "Held", "Key", "Ledger", "MadeBy", "Sailed", "WorkerDiedError", "file_hash", "in_processes", "made_by",
    "read_results", "sail", "settled",
]
