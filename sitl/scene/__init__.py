"""A scene: the scenario's file, its weather, its other vessels, and the judge of what the boat did."""
