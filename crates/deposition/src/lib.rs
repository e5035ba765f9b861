//! The bead: sections, process maps, pursuit, cumulative deposit and its levelling, layer growth.
