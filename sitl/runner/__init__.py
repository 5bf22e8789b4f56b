"""The runner: seeded jobs over processes or a Dask cluster, and the file in which each result stays as it comes."""

from sitl.runner.cargo import Cargo, file_hash
from sitl.runner.identity import MadeBy, made_by
from sitl.runner.ledger import Held, Key, Ledger, read_results
from sitl.runner.processes import WorkerDiedError, in_processes, settled
from sitl.runner.sailing import Sailed, sail
from sitl.runner.table import Table, joined, read_table, table_of, write_table

__all__ = [
    "Cargo", "Held", "Key", "Ledger", "MadeBy", "Sailed", "Table", "WorkerDiedError", "file_hash", "in_processes",
    "joined", "made_by", "read_results", "read_table", "sail", "settled", "table_of", "write_table",
]
