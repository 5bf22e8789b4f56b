"""One step: what the skipper sees, remembers, may do and asks for, and the step in the making."""

from companion.skipper.step.actions import (
    Acknowledge,
    Action,
    AdoptDrawing,
    Announce,
    Arm,
    CancelPlan,
    ReadMission,
    ReplanReason,
    RequestPlan,
    RunMotor,
    SetCurrent,
    SetMode,
    SteerHeading,
    StopOrders,
    Tack,
    UploadFence,
    UploadMission,
)
from companion.skipper.step.config import Ends, Guidance, Permissions, ReplanPolicy, SafeEnd, SkipperConfig
from companion.skipper.step.context import StepContext
from companion.skipper.step.missions import ends_safely
from companion.skipper.step.route import Diversion, DiversionKind, Route
from companion.skipper.step.saved import Persisted
from companion.skipper.step.snapshot import (
    AutopilotRebooted,
    CommandOutcome,
    CommandResult,
    Disbelieved,
    Event,
    MissionOnBoard,
    ModeChanged,
    Outcome,
    ParameterChanged,
    PlanOutcome,
    ReadOutcome,
    Snapshot,
    UploadOutcome,
    UploadResult,
    WaypointReached,
    WindBefore,
    WindEstimate,
    WindHealth,
)
from companion.skipper.step.state import Phase, SkipperState, is_given_up

__all__ = [
    "Acknowledge", "Action", "AdoptDrawing", "Announce", "Arm", "AutopilotRebooted", "CancelPlan", "CommandOutcome",
    "CommandResult", "Disbelieved", "Diversion", "DiversionKind", "Ends", "Event", "Guidance", "MissionOnBoard",
    "ModeChanged", "Outcome", "ParameterChanged", "Permissions", "Persisted", "Phase", "PlanOutcome", "ReadMission",
    "ReadOutcome", "ReplanPolicy", "ReplanReason", "RequestPlan", "Route", "RunMotor", "SafeEnd", "SetCurrent",
    "SetMode", "SkipperConfig", "SkipperState", "Snapshot", "SteerHeading", "StepContext", "StopOrders", "Tack",
    "UploadFence", "UploadMission", "UploadOutcome", "UploadResult", "WaypointReached", "WindBefore", "WindEstimate",
    "WindHealth", "ends_safely", "is_given_up",
]
