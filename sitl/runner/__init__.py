"""The runner: seeded jobs over processes or a Dask cluster, and the file in which each result stays as it comes."""

from sitl.runner.executors import WorkerDiedError, settled
from sitl.runner.experiment import CampaignResults, Experiment, ExperimentSummary, sail_kept
from sitl.runner.job import SCENARIO_FOLDER, Job, ScenarioBundle, file_hash
from sitl.runner.result_store import (
    Key,
    MadeBy,
    ResultStore,
    Table,
    joined,
    made_by,
    read_results,
    read_table,
    require_free,
    table_of,
    write_table,
)

__all__ = [
    "SCENARIO_FOLDER",
    "CampaignResults",
    "Experiment",
    "ExperimentSummary",
    "Job",
    "Key",
    "MadeBy",
    "ResultStore",
    "ScenarioBundle",
    "Table",
    "WorkerDiedError",
    "file_hash",
    "joined",
    "made_by",
    "read_results",
    "read_table",
    "require_free",
    "sail_kept",
    "settled",
    "table_of",
    "write_table",
]
