"""Running a scenario: under the virtual clock, live with processes of their own, on the real ArduRover."""
