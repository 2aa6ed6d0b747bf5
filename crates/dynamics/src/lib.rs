//! Robot descriptions, rigid-body algorithms and the Panda.
