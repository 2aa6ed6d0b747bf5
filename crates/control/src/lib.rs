//! The active inference controller, MRAC and baselines as pure step functions.
