//! What people look at: series, tables, fields in; offline HTML, ParaView files, CSV out. Knows no physics.
