"""The boat on the water, the compiled 50 Hz loop that steers it, and the parameters that set both."""
