"""The world: wind, boats as physics, the air that radios share."""
