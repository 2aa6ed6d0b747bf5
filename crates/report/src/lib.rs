//! Records of a run to one self-contained page.
