//! What controllers read: one module per dialect, each a writer and a parser.
