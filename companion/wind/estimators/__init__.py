"""The estimators: one interface, Büsser's, Wolsieffer's and the default forecaster, by name."""
