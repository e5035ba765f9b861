//! Instructions of RAPID that shape no metal, in capitals.

/// Those that take no time.
pub(crate) const ACTS: [&str; 20] = [
    "CONFL",
    "CONFJ",
    "SINGAREA",
    // as it is without
    "ACCSET100,100",
    "TPWRITE",
    "TPERASE",
    "TPSHOW",
    "ERRWRITE",
    "CORNERPATHWARNING",
    "SETDO",
    "RESET",
    "PULSEDO",
    "INVERTDO",
    "CLKSTART",
    "CLKSTOP",
    "CLKRESET",
    "MOTIONSUP",
    // whether its axes move the part is told by the positions
    "ACTUNIT",
    "DEACTUNIT",
    "GRIPLOAD",
];

/// Those that wait.
pub(crate) const WAITS: [&str; 8] = [
    "WAITDI",
    "WAITDO",
    "WAITAI",
    "WAITAO",
    "WAITGI",
    "WAITGO",
    "WAITUNTIL",
    "STOP",
];
