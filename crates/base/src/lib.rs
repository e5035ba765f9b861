//! Quantities with units, values with origin, warnings, progress, verdicts, whole-or-nothing output, the native container.
