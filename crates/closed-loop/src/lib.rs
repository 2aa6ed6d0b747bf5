//! Plant, controller and task together: in time, and linearised.
