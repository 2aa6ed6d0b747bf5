//! Constants of an arm that the certificates rest on.
