"""What the autopilot decides: modes, the mission, the fence, failsafes, arming. It knows no MAVLink link."""
