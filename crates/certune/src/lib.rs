//! Certified tuning of robot-arm controllers.
