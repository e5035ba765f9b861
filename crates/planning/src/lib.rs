//! From shape to toolpath: filling, ordering, links. Bead knowledge comes in as plain values.
