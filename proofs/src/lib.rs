//! The claims that CI re-derives.
