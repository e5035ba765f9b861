//! The common language between rooms: passes, toolpaths, profiles, motion.
