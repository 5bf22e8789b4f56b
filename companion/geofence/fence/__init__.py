"""The autopilot's own fence: an area in the few items that it holds, and the proof of them."""

from companion.geofence.fence.autopilot_fence import AutopilotFence, FenceStatus, fence_for_autopilot

__all__ = ["AutopilotFence", "FenceStatus", "fence_for_autopilot"]
