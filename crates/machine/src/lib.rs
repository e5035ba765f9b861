//! From commanded moves to what the machine will really do.
