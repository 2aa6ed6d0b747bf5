//! Proptest strategies for arms, masses and states.
