//! A claim in, a certificate or a refusal with a counterexample out.
